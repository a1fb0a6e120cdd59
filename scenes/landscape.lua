-- A mountain lake in autumn: fractal terrain with rock and snow, about 100,000 trees and 900,000 tufts of grass, in groups of groups.
-- One unit is a metre. The eye is near the origin and looks along -z; the lake's surface is y = 0.

local tessera = require("tessera")
local noise = require("scenes.noise")
local terrain = require("scenes.terrain")
local vegetation = require("scenes.vegetation")

local landscape = {}

local height, half_width, spot = terrain.height, terrain.half_width, terrain.spot

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
        if height(x, z) <= 3 then continue end -- in the water
        local tree, y, slope = lay(grove, x, z, 6)
        -- Not on cliffs, thinner towards the tree line, with clearings.
        if slope < 1 and y < terrain.TREE_LINE * random:uniform(0.5, 1) and noise.fractal(x / 130, z / 130, 3) > -0.28 then
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
        local z = terrain.NEAR - 230 * random:uniform() ^ 2.2
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
    local random, kinds, group = tessera.random(13), {}, {}
    for i = 1, 4 do
        kinds[i] = vegetation.boulder(i)
    end
    for _ = 1, count do
        local z = -13 - 125 * random:uniform() ^ 2
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
            terrain.object(options.detail or 420),
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
