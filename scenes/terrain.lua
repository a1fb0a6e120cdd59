-- The ground of `scenes/landscape.lua`: fractal hills and mountains around a lake, of meadow, rock and snow. One unit is a metre; the eye is
-- near the origin and looks along -z, the lake's surface is y = 0.

local tessera = require("tessera")
local forms = require("scenes.forms")
local noise = require("scenes.noise")

local terrain = {}

local NEAR, FAR = 30, -3600 -- where it begins and ends along z
local SNOW_LINE = 330

terrain.NEAR, terrain.TREE_LINE = NEAR, 250

local function smoothstep(from, to, x)
    local t = math.clamp((x - from) / (to - from), 0, 1)
    return t * t * (3 - 2 * t)
end

-- Height of the ground: a meadow at the eye, a basin for the lake, hills around it, mountains behind.
function terrain.height(x, z)
    local mountains = smoothstep(-1000, -2900, z) + 0.55 * smoothstep(350, 1500, math.abs(x + 80)) * smoothstep(-150, -700, z)
    local y = 14
    -- Where there are none, as around the eye, the time for them is saved.
    if mountains > 0 then
        y += 430 * mountains * (noise.ridged(x / 1300 + 3.1, z / 1300 + 0.4, 8) - 0.25)
    end
    y += (6 + 34 * smoothstep(-80, -500, z)) * noise.fractal(x / 240, z / 240, 5)
    -- The eye stands on a rise above the shore.
    y += 30 * smoothstep(-150, -5, z)
    -- The lake: an ellipse a little right of the middle, with a ragged shore.
    local lake = ((x - 70) / 330) ^ 2 + ((z + 520) / 400) ^ 2 + 0.25 * noise.plane(x / 110, z / 110)
    return y - 58 * (1 - smoothstep(0.25, 1.35, lake))
end

-- Half of the terrain's width at z: the view's, and something beside it.
function terrain.half_width(z)
    return 60 + 0.85 * (NEAR - z)
end

-- Place of a grid's point, both from 0 to 1: closer together near the eye.
function terrain.spot(across, away)
    local z = NEAR + (FAR - NEAR) * away ^ 2
    return (2 * across - 1) * terrain.half_width(z), z
end

-- The triangles of a mesh in three lists: meadow, rock where it is steep or high, snow where it is higher and not too steep.
local function kinds(mesh)
    local lists = { {}, {}, {} }
    for at = 0, buffer.len(mesh.triangles) - 12, 12 do
        local corner = buffer.readu32(mesh.triangles, at)
        local function read(from, k) return buffer.readf32(from, 12 * corner + 4 * k) end
        local x, y, z = read(mesh.positions, 0), read(mesh.positions, 1), read(mesh.positions, 2)
        local nx, ny, nz = read(mesh.normals, 0), read(mesh.normals, 1), read(mesh.normals, 2)
        local upright = ny / math.sqrt(nx * nx + ny * ny + nz * nz)
        local edge = 120 * noise.fractal(x / 90, z / 90, 3)
        local kind = if y + edge > SNOW_LINE and upright > 0.55 then 3 elseif upright < 0.76 or y + edge > terrain.TREE_LINE + 60 then 2 else 1
        table.insert(lists[kind], at)
    end
    return lists
end

-- The whole ground; `detail` is the number of points along its edges.
function terrain.object(detail)
    local mesh = forms.sheet(detail, detail, function(row, column)
        -- Rows go along x and columns towards the eye, so that it faces up.
        local x, z = terrain.spot(row / (detail - 1), 1 - column / (detail - 1))
        return x, terrain.height(x, z), z
    end)
    local group = {}
    local materials = { tessera.hex("#4a5527"), tessera.hex("#6d675f"), { 0.8, 0.82, 0.86 } }
    for kind, list in kinds(mesh) do
        local part = buffer.create(12 * #list)
        for i, at in list do
            buffer.copy(part, 12 * (i - 1), mesh.triangles, at, 12)
        end
        local piece = { positions = mesh.positions, normals = mesh.normals, triangles = part }
        table.insert(group, forms.mesh(piece, tessera.diffuse { reflectance = materials[kind] }, nil, "terrain"))
    end
    return tessera.group(group)
end

return terrain
