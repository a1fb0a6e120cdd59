-- A mountain lake in autumn: fractal terrain with rock and snow, about 100,000 trees and 900,000 tufts of grass, in groups of groups.
-- One unit is a metre. The eye is near the origin and looks along -z; the lake's surface is y = 0.

local tessera = require("tessera")
local forms = require("scenes.forms")
local noise = require("scenes.noise")
local vegetation = require("scenes.vegetation")

local landscape = {}

local NEAR, FAR = 30, -3600        -- where the terrain begins and ends along z
local TREE_LINE, SNOW_LINE = 250, 330

local function smoothstep(from, to, x)
    local t = math.clamp((x - from) / (to - from), 0, 1)
    return t * t * (3 - 2 * t)
end

-- Height of the ground: a meadow at the eye, a basin for the lake, hills around it, mountains behind.
local function height(x, z)
    local mountains = smoothstep(-1000, -2900, z) + 0.55 * smoothstep(350, 1500, math.abs(x + 80)) * smoothstep(-150, -700, z)
    local y = 14 + 430 * mountains * (noise.ridged(x / 1300 + 3.1, z / 1300 + 0.4, 8) - 0.25)
    y += (6 + 34 * smoothstep(-80, -500, z)) * noise.fractal(x / 240, z / 240, 5)
    -- The eye stands on a rise above the shore.
    y += 30 * smoothstep(-150, -5, z)
    -- The lake: an ellipse a little right of the middle, with a ragged shore.
    local lake = ((x - 70) / 330) ^ 2 + ((z + 520) / 400) ^ 2 + 0.25 * noise.plane(x / 110, z / 110)
    return y - 58 * (1 - smoothstep(0.25, 1.35, lake))
end

-- Half of the terrain's width at z: the view's, and something beside it.
local function half_width(z)
    return 60 + 0.85 * (NEAR - z)
end

-- Place of a grid's point, both from 0 to 1: closer together near the eye.
local function spot(across, away)
    local z = NEAR + (FAR - NEAR) * away ^ 2
    return (2 * across - 1) * half_width(z), z
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
        local kind = if y + edge > SNOW_LINE and upright > 0.55 then 3 elseif upright < 0.76 or y + edge > TREE_LINE + 60 then 2 else 1
        table.insert(lists[kind], at)
    end
    return lists
end

local function terrain(detail)
    local mesh = forms.sheet(detail, detail, function(row, column)
        -- Rows go along x and columns towards the eye, so that it faces up.
        local x, z = spot(row / (detail - 1), 1 - column / (detail - 1))
        return x, height(x, z), z
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

-- Lays a group onto the ground: sheared along the slope, so that what grows in it stays upright.
local function lay(group, x, z, reach)
    local y = height(x, z)
    local along, away = (height(x + reach, z) - y) / reach, (height(x, z + reach) - y) / reach
    local slope = math.sqrt(along * along + away * away)
    return tessera.instance { group = group, transform = tessera.matrix { { 1, 0, 0, x }, { along, 1, away, y }, { 0, 0, 1, z } } }, y, slope
end

local function forest(count)
    local random, groves, trees = tessera.random(2), {}, {}
    for i = 1, 8 do
        -- Some groves are dark, some golden.
        groves[i] = vegetation.grove(i, 14, 13, if i <= 5 then 0.05 else 0.85)
    end
    while #trees < count do
        local x, z = spot(random:uniform(), random:uniform(0.16, 0.95))
        -- In front of the lake the view is kept open, with a few trees at the left to frame it.
        if z > -260 and x > 0.34 * z - 4 and x < -0.62 * z then continue end
        local golden = noise.plane(x / 170, z / 170) > 0.12
        local grove = groves[if golden then random:integer(6, 8) else random:integer(1, 5)]
        local tree, y, slope = lay(grove, x, z, 6)
        -- Not in the water, not on cliffs, thinner towards the tree line, with clearings.
        if y > 3 and slope < 1 and y < TREE_LINE * random:uniform(0.5, 1) and noise.fractal(x / 130, z / 130, 3) > -0.28 then
            table.insert(trees, tree)
        end
    end
    return tessera.group(trees)
end

local function meadow(count)
    local random, squares, grass = tessera.random(4), {}, {}
    for i = 1, 8 do
        squares[i] = vegetation.meadow(i, 100, 3)
    end
    while #grass < count do
        local z = NEAR - 230 * random:uniform() ^ 2.2
        local x = half_width(z) * random:uniform(-1, 1)
        local square, y = lay(random:choice(squares), x, z, 1)
        if y > 0.3 then
            table.insert(grass, square)
        end
    end
    return tessera.group(grass)
end

-- Boulders in the meadow, larger farther away, where they lie on the shore.
local function boulders(count)
    local random, kinds, group = tessera.random(12), {}, {}
    for i = 1, 4 do
        kinds[i] = vegetation.boulder(i)
    end
    for _ = 1, count do
        local z = -6 - 130 * random:uniform() ^ 2
        local x = half_width(z) * random:uniform(-0.8, 0.8)
        local size = random:uniform(0.3, 0.9) * (1 - z / 45)
        table.insert(group, tessera.instance {
            group = random:choice(kinds),
            transform = tessera.translate(x, height(x, z), z) * tessera.rotate({ 0, 1, 0 }, random:uniform(0, 360)) * tessera.scale(size),
        })
    end
    return tessera.group(group)
end

-- `groves` of 14 trees, `squares` of 100 tufts; `detail` is the number of points along the terrain's edges.
function landscape.scene(options)
    local water = tessera.plastic { reflectance = { 0.006, 0.018, 0.02 }, ior = 1.33, roughness = 0.13 }
    return tessera.scene {
        objects = {
            terrain(options.detail or 420),
            forest(options.groves or 7500),
            meadow(options.squares or 9000),
            boulders(90),
            tessera.rectangle { center = { 0, 0, -700 }, edge_u = { 3000, 0, 0 }, edge_v = { 0, 0, -1500 }, material = water, name = "lake" },
        },
        -- Late afternoon: from the left and a little from behind, so that slopes show their shape.
        background = tessera.sky { sun = { -0.85, 0.36, 0.28 }, turbidity = 2.4, ground = { 0.1, 0.12, 0.07 } },
    }
end

function landscape.eye()
    return { 0, height(0, 0) + 3.2, 0 }
end

return landscape
