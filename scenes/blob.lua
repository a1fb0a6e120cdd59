-- A smooth closed mesh around a skeleton of thick strokes that melt into each other, such as flesh around bones.

local forms = require("scenes.forms")

local blob = {}

-- Distance to the nearest of the strokes, negative inside. A stroke is { from, to, radius, to_radius }; within `melt` of each other two become
-- one (Quilez' polynomial minimum). `flat` is how much thinner everything is along z.
local function distance(strokes, melt, flat, x, y, z)
    local nearest = math.huge
    z *= flat
    for _, s in strokes do
        local px, py, pz = x - s.x, y - s.y, z - s.z
        local t = math.clamp((px * s.dx + py * s.dy + pz * s.dz) * s.inverse, 0, 1)
        px -= t * s.dx; py -= t * s.dy; pz -= t * s.dz
        local d = math.sqrt(px * px + py * py + pz * pz) - s.radius - t * s.grows
        local near = math.max(melt - math.abs(nearest - d), 0)
        nearest = math.min(nearest, d) - near * near / (4 * melt)
    end
    return nearest / flat
end

local function prepared(strokes, flat)
    local list = {}
    for _, s in strokes do
        local from, to = s[1], s[2]
        local dx, dy, dz = to[1] - from[1], to[2] - from[2], (to[3] - from[3]) * flat
        table.insert(list, {
            x = from[1], y = from[2], z = from[3] * flat, dx = dx, dy = dy, dz = dz,
            inverse = 1 / (dx * dx + dy * dy + dz * dz), radius = s[3], grows = s[4] - s[3],
        })
    end
    return list
end

-- Where the surface passes through a cell: the mean of where it crosses the cell's edges. Nothing where it does not.
local function crossing(values, corner, strides)
    local sum, count = vector.zero, 0
    for axis = 1, 3 do
        local b, c = axis % 3 + 1, (axis + 1) % 3 + 1
        for k = 0, 3 do
            local i, j = k % 2, k // 2
            local from = corner + i * strides[b] + j * strides[c]
            local low, high = values[from], values[from + strides[axis]]
            if (low < 0) ~= (high < 0) then
                local place = { 0, 0, 0 }
                place[axis], place[b], place[c] = low / (low - high), i, j
                sum += vector.create(place[1], place[2], place[3])
                count += 1
            end
        end
    end
    return if count > 0 then sum / count else nil
end

-- Surface nets (Gibson 1998): a vertex in each cell that the surface passes, a square across each edge of the grid that it crosses.
-- `low` and `high` are the corners of a box around all of it, `cell` the grid's distance.
function blob.mesh(strokes, options)
    local low, high, cell, flat = options.low, options.high, options.cell, options.flat or 1
    local list = prepared(strokes, flat)
    local count, values = {}, {}
    for axis = 1, 3 do
        count[axis] = math.ceil((high[axis] - low[axis]) / cell) + 1
    end
    for k = 0, count[3] - 1 do
        for j = 0, count[2] - 1 do
            for i = 0, count[1] - 1 do
                table.insert(values, distance(list, options.melt, flat, low[1] + cell * i, low[2] + cell * j, low[3] + cell * k))
            end
        end
    end

    local strides = { 1, count[1], count[1] * count[2] }
    local positions, triangles, vertex = {}, {}, {}
    local function each_cell(from, visit)
        for k = from, count[3] - 2 do
            for j = from, count[2] - 2 do
                for i = from, count[1] - 2 do
                    visit(1 + i + j * strides[2] + k * strides[3], i, j, k)
                end
            end
        end
    end
    each_cell(0, function(corner, i, j, k)
        -- A cell far from the surface is passed over quickly.
        if math.abs(values[corner]) > 2 * cell then return end
        local place = crossing(values, corner, strides)
        if place then
            vertex[corner] = #positions // 3
            table.insert(positions, low[1] + cell * (i + place.x))
            table.insert(positions, low[2] + cell * (j + place.y))
            table.insert(positions, low[3] + cell * (k + place.z))
        end
    end)
    each_cell(1, function(corner)
        for axis = 1, 3 do
            local inside, beyond = values[corner] < 0, values[corner + strides[axis]] < 0
            if inside ~= beyond then
                local b, c = strides[axis % 3 + 1], strides[(axis + 1) % 3 + 1]
                local p, q, r, s = vertex[corner - b - c], vertex[corner - c], vertex[corner], vertex[corner - b]
                -- Counter-clockwise seen from outside: along the axis where the inside is below.
                for _, index in (if inside then { p, q, r, p, r, s } else { p, r, q, p, s, r }) do
                    table.insert(triangles, index)
                end
            end
        end
    end)
    return forms.smooth(positions, triangles)
end

return blob
