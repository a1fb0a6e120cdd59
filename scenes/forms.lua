-- Smooth meshes made by formula, in buffers: each function returns the geometry of `tessera.mesh`, to which `forms.mesh` adds a material and
-- a place. A point given twice in a row makes a sharp edge there.

local tessera = require("tessera")

local forms = {}

local function pack(numbers, write, bytes)
    local packed = buffer.create(#numbers * bytes)
    for i, number in numbers do
        write(packed, (i - 1) * bytes, number)
    end
    return packed
end

-- Adds to each corner of a triangle its normal, as long as twice its area, so that large faces count for more.
-- False where the triangle has no area.
local function add_normal(positions, normals, a, b, c)
    local ax, ay, az = positions[3 * a + 1], positions[3 * a + 2], positions[3 * a + 3]
    local ux, uy, uz = positions[3 * b + 1] - ax, positions[3 * b + 2] - ay, positions[3 * b + 3] - az
    local vx, vy, vz = positions[3 * c + 1] - ax, positions[3 * c + 2] - ay, positions[3 * c + 3] - az
    local x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    -- Compared with the edges, so that it does not matter in which unit they are.
    local longest = math.max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    if x * x + y * y + z * z <= 1e-12 * longest * longest then
        return false
    end
    normals[3 * a + 1] += x; normals[3 * a + 2] += y; normals[3 * a + 3] += z
    normals[3 * b + 1] += x; normals[3 * b + 2] += y; normals[3 * b + 3] += z
    normals[3 * c + 1] += x; normals[3 * c + 2] += y; normals[3 * c + 3] += z
    return true
end

-- A mesh of triangles, counted from 0, in flat lists of numbers; its normals are made from its faces.
function forms.smooth(positions, triangles, uvs)
    local normals, kept = table.create(#positions, 0), {}
    for at = 1, #triangles, 3 do
        local a, b, c = triangles[at], triangles[at + 1], triangles[at + 2]
        if add_normal(positions, normals, a, b, c) then
            table.insert(kept, a)
            table.insert(kept, b)
            table.insert(kept, c)
        end
    end
    -- Vertices that no face touches, at poles and edges, still need a normal of some length.
    for at = 1, #normals, 3 do
        if normals[at] == 0 and normals[at + 1] == 0 and normals[at + 2] == 0 then normals[at + 1] = 1 end
    end
    return {
        positions = pack(positions, buffer.writef32, 4),
        normals = pack(normals, buffer.writef32, 4),
        uvs = if uvs then pack(uvs, buffer.writef32, 4) else nil,
        triangles = pack(kept, buffer.writeu32, 4),
    }
end

-- A sheet of `rows` x `columns` points: at(row, column), both from 0, returns x, y, z. With `around`, the last column joins the first.
-- It faces columns x rows: up, where rows go along x and columns along z.
function forms.sheet(rows, columns, at, around)
    local positions, uvs, triangles = {}, {}, {}
    for row = 0, rows - 1 do
        for column = 0, columns - 1 do
            local x, y, z = at(row, column)
            table.insert(positions, x)
            table.insert(positions, y)
            table.insert(positions, z)
            table.insert(uvs, column / columns)
            table.insert(uvs, row / (rows - 1))
        end
    end
    for row = 0, rows - 2 do
        for column = 0, (if around then columns else columns - 1) - 1 do
            local next = (column + 1) % columns
            local a, b, c, d = row * columns + column, (row + 1) * columns + column, (row + 1) * columns + next, row * columns + next
            local n = #triangles
            triangles[n + 1], triangles[n + 2], triangles[n + 3] = a, c, b
            triangles[n + 4], triangles[n + 5], triangles[n + 6] = a, d, c
        end
    end
    return forms.smooth(positions, triangles, uvs)
end

-- A curve through points of any number of coordinates (Catmull and Rom's), `steps` to each pair.
function forms.spline(points, steps)
    local curve = {}
    for i = 1, #points - 1 do
        local b, c = points[i], points[i + 1]
        local a, d = points[i - 1] or b, points[i + 2] or c
        for step = 0, steps - 1 do
            local t, point, still = step / steps, {}, true
            for k = 1, #b do
                still = still and b[k] == c[k]
                point[k] = b[k] + 0.5 * t * (c[k] - a[k] + t * (2 * a[k] - 5 * b[k] + 4 * c[k] - d[k] + t * (3 * (b[k] - c[k]) + d[k] - a[k])))
            end
            -- A sharp edge: the point alone, without the loop that the curve would make there.
            if still then
                table.insert(curve, b)
                break
            end
            table.insert(curve, point)
        end
    end
    table.insert(curve, points[#points])
    return curve
end

-- A body of revolution about the y axis: `profile` lists {radius, height}. It faces outwards where the profile goes up, and inwards where
-- it comes down again.
function forms.lathe(profile, columns)
    columns = columns or 96
    return forms.sheet(#profile, columns, function(row, column)
        local radius, height = profile[row + 1][1], profile[row + 1][2]
        local angle = 2 * math.pi * column / columns
        return radius * math.cos(angle), height, -radius * math.sin(angle)
    end, true)
end

-- A closed tube along points; `radius` is a number, or a function of the place from 0 to 1.
function forms.tube(points, radius, columns)
    columns = columns or 16
    local count, rings = #points, {}
    local side = vector.create(0.31, 0.17, 0.93) -- any direction will do that is not along the tube
    for i = 1, count do
        local before, after = points[math.max(i - 1, 1)], points[math.min(i + 1, count)]
        local along = vector.normalize(vector.create(after[1] - before[1], after[2] - before[2], after[3] - before[3]))
        -- The last ring's side, made perpendicular again: rings follow each other without a twist.
        side = vector.normalize(side - along * vector.dot(side, along))
        local thick = if type(radius) == "function" then radius((i - 1) / (count - 1)) else radius
        local ring = { middle = points[i], side = side * thick, across = vector.cross(along, side) * thick }
        local point = { middle = points[i], side = vector.zero, across = vector.zero }
        -- The ends are flat: a ring without radius, then the same ring twice for its sharp edge.
        for _, r in (if i == 1 then { point, ring, ring } elseif i == count then { ring, ring, point } else { ring }) do
            table.insert(rings, r)
        end
    end
    return forms.sheet(#rings, columns, function(row, column)
        local ring, angle = rings[row + 1], 2 * math.pi * column / columns
        local offset = ring.side * math.cos(angle) + ring.across * math.sin(angle)
        return ring.middle[1] + offset.x, ring.middle[2] + offset.y, ring.middle[3] + offset.z
    end, true)
end

-- `tessera.mesh` of a geometry, with its material and perhaps a transform and a name.
function forms.mesh(geometry, material, transform, name)
    local mesh = table.clone(geometry)
    mesh.material, mesh.transform, mesh.name = material, transform, name
    return tessera.mesh(mesh)
end

return forms
