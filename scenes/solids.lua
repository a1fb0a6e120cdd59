-- Meshes made by formula: each function returns the geometry of `tessera.mesh`, to which the caller adds material and place.
-- Vertices are counted from 1.

local solids = {}

local function add(a, b) return { a[1] + b[1], a[2] + b[2], a[3] + b[3] } end
local function scale(a, s) return { a[1] * s, a[2] * s, a[3] * s } end
local function cross(a, b)
    return { a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1] }
end
local function unit(a)
    return scale(a, 1 / math.sqrt(a[1] * a[1] + a[2] * a[2] + a[3] * a[3]))
end

-- Triangles of a grid of `rows` x `columns` vertices, closed around its columns and, with `closed`, around its rows too.
local function grid(rows, columns, closed)
    local triangles = {}
    local function index(row, column) return (row % rows) * columns + column % columns + 1 end
    for row = 0, (if closed then rows else rows - 1) - 1 do
        for column = 0, columns - 1 do
            local a, b = index(row, column), index(row + 1, column)
            local c, d = index(row + 1, column + 1), index(row, column + 1)
            table.insert(triangles, { a, c, b })
            table.insert(triangles, { a, d, c })
        end
    end
    return triangles
end

-- A tube of radius `tube` along the (p, q) torus knot on a torus of radii `major` and `minor`, about the y axis.
function solids.torus_knot(options)
    local p, q = options.p or 2, options.q or 3
    local major, minor, tube = options.major or 1, options.minor or 0.4, options.tube or 0.15
    local rows, columns = options.rows or 256, options.columns or 24
    local positions, normals = {}, {}
    for row = 0, rows - 1 do
        local t = 2 * math.pi * row / rows
        local cp, sp, cq, sq = math.cos(p * t), math.sin(p * t), math.cos(q * t), math.sin(q * t)
        local center = { (major + minor * cq) * cp, minor * sq, (major + minor * cq) * sp }
        local outward = { cq * cp, sq, cq * sp }
        local along = unit {
            -q * minor * sq * cp - p * (major + minor * cq) * sp,
            q * minor * cq,
            -q * minor * sq * sp + p * (major + minor * cq) * cp,
        }
        local across = cross(along, outward)
        for column = 0, columns - 1 do
            local a = 2 * math.pi * column / columns
            local normal = add(scale(outward, math.cos(a)), scale(across, math.sin(a)))
            table.insert(normals, normal)
            table.insert(positions, add(center, scale(normal, tube)))
        end
    end
    return { positions = positions, normals = normals, triangles = grid(rows, columns, true) }
end

-- A body of revolution about the y axis: `profile` lists {radius, height} from the bottom to the top, radii above 0.
function solids.lathe(profile, columns)
    columns = columns or 64
    local positions = {}
    for _, point in profile do
        for column = 0, columns - 1 do
            local a = 2 * math.pi * column / columns
            table.insert(positions, { point[1] * math.cos(a), point[2], -point[1] * math.sin(a) })
        end
    end
    return { positions = positions, triangles = grid(#profile, columns, false) }
end

local GOLDEN = (1 + math.sqrt(5)) / 2

-- A regular icosahedron of the given radius, flat faces.
function solids.icosahedron(radius)
    local g = GOLDEN
    local corners = {
        { -1, g, 0 }, { 1, g, 0 }, { -1, -g, 0 }, { 1, -g, 0 }, { 0, -1, g }, { 0, 1, g },
        { 0, -1, -g }, { 0, 1, -g }, { g, 0, -1 }, { g, 0, 1 }, { -g, 0, -1 }, { -g, 0, 1 },
    }
    local positions = {}
    for _, corner in corners do
        table.insert(positions, scale(unit(corner), radius))
    end
    local triangles = {
        { 1, 12, 6 }, { 1, 6, 2 }, { 1, 2, 8 }, { 1, 8, 11 }, { 1, 11, 12 },
        { 2, 6, 10 }, { 6, 12, 5 }, { 12, 11, 3 }, { 11, 8, 7 }, { 8, 2, 9 },
        { 4, 10, 5 }, { 4, 5, 3 }, { 4, 3, 7 }, { 4, 7, 9 }, { 4, 9, 10 },
        { 5, 10, 6 }, { 3, 5, 12 }, { 7, 3, 11 }, { 9, 7, 8 }, { 10, 9, 2 },
    }
    return { positions = positions, triangles = triangles }
end

-- A cut gem that stands on its point at the origin: pavilion, girdle, crown and table, `sides` facets around, flat faces.
function solids.gem(options)
    local sides, radius, height = options.sides or 8, options.radius or 0.5, options.height or 0.9
    local positions, triangles = { { 0, 0, 0 } }, {}
    for ring, shape in { { 1.0, 0.68 }, { 0.58, 1.0 } } do
        for side = 0, sides - 1 do
            local a = 2 * math.pi * (side + 0.5 * ring) / sides
            table.insert(positions, { radius * shape[1] * math.cos(a), height * shape[2], radius * shape[1] * math.sin(a) })
        end
    end
    table.insert(positions, { 0, height, 0 })
    local function girdle(side) return 2 + side % sides end
    local function crown(side) return 2 + sides + side % sides end
    local top = 2 + 2 * sides
    for side = 0, sides - 1 do
        table.insert(triangles, { 1, girdle(side), girdle(side + 1) })
        table.insert(triangles, { girdle(side), crown(side), girdle(side + 1) })
        table.insert(triangles, { girdle(side + 1), crown(side), crown(side + 1) })
        table.insert(triangles, { crown(side), top, crown(side + 1) })
    end
    return { positions = positions, triangles = triangles }
end

-- The same geometry with further keys of `tessera.mesh`.
function solids.with(geometry, keys)
    local mesh = table.clone(geometry)
    for key, value in keys do
        mesh[key] = value
    end
    return mesh
end

return solids
