-- A room in the morning: sun and sky come in through two windows and the open side behind the camera, fall on a table that is laid for tea, and light the rest from there.
-- One unit is a metre; the windows are in the wall at the left, the camera looks from the room's front to its back.

local tessera = require("tessera")
local forms = require("scenes.forms")
local furniture = require("scenes.furniture")
local tableware = require("scenes.tableware")

local interior = {}

local LEFT, RIGHT, BACK, FRONT, HEIGHT = -2.6, 2.6, -3.2, 3.4, 2.8
local SILL, LINTEL = 0.75, 2.35            -- heights of the windows' borders
local WINDOWS = { { -2.7, -1.1 }, { -0.2, 1.4 } } -- from where to where along z
local THICK = 0.25                         -- of the wall with the windows

local PLASTER = tessera.diffuse { reflectance = tessera.hex("#ece5d8") }
local SAGE = tessera.diffuse { reflectance = tessera.hex("#b3bda4") }
local PAINT = tessera.plastic { reflectance = tessera.hex("#f2efe8"), roughness = 0.35 }

local function box(low, high, material, name)
    return tessera.box { min = low, max = high, material = material, name = name }
end

-- Boards along z, each of narrow strips of slightly different browns: the grain.
local function floor()
    local random, group = tessera.random(11), {}
    local browns = {}
    for i = 1, 10 do
        local shade = 0.62 + 0.06 * i
        browns[i] = tessera.plastic { reflectance = { 0.36 * shade, 0.20 * shade, 0.095 * shade }, roughness = 0.38 }
    end
    local board, gap, strips = 0.16, 0.003, 7
    for x = LEFT, RIGHT, board do
        local z = BACK - random:uniform(0, 1.5)
        while z < FRONT do
            local length, tone = random:uniform(1.1, 2.0), random:integer(2, 9)
            for strip = 0, strips - 1 do
                local width = (board - gap) / strips
                local brown = browns[math.clamp(tone + random:integer(-1, 1), 1, 10)]
                table.insert(group, box({ x + strip * width, -0.02, z }, { x + (strip + 1) * width, 0, z + length - gap }, brown))
            end
            z += length
        end
    end
    table.insert(group, box({ LEFT, -0.1, BACK }, { RIGHT, -0.021, FRONT }, tessera.diffuse { reflectance = 0.02 }, "under the boards"))
    return tessera.group(group)
end

-- The left wall: what is below and above the windows, and the pieces between them.
local function window_wall()
    local out = LEFT - THICK
    local group = {
        box({ out, 0, BACK }, { LEFT, SILL, FRONT }, PLASTER),
        box({ out, LINTEL, BACK }, { LEFT, HEIGHT, FRONT }, PLASTER),
    }
    local from = BACK
    for _, window in WINDOWS do
        table.insert(group, box({ out, SILL, from }, { LEFT, LINTEL, window[1] }, PLASTER))
        from = window[2]
    end
    table.insert(group, box({ out, SILL, from }, { LEFT, LINTEL, FRONT }, PLASTER))
    return tessera.group(group)
end

-- Frames with a cross of bars, and a sill. No panes: clean glass only makes light harder to find.
local function window_frames()
    local group, bar = {}, 0.035
    local x = LEFT - 0.16
    for _, window in WINDOWS do
        local near, far, middle = window[2], window[1], 0.5 * (window[1] + window[2])
        for _, z in { far + bar, middle, near - bar } do
            table.insert(group, box({ x - 0.03, SILL, z - bar }, { x + 0.03, LINTEL, z + bar }, PAINT))
        end
        for _, y in { SILL + bar, SILL + 1.05, LINTEL - bar } do
            table.insert(group, box({ x - 0.025, y - bar, far }, { x + 0.025, y + bar, near }, PAINT))
        end
        table.insert(group, box({ LEFT - 0.1, SILL - 0.04, far - 0.06 }, { LEFT + 0.1, SILL + 0.005, near + 0.06 }, PAINT, "sill"))
    end
    return tessera.group(group)
end

local function walls()
    return tessera.group {
        window_wall(),
        window_frames(),
        box({ LEFT - THICK, 0, BACK - 0.1 }, { RIGHT, HEIGHT, BACK }, SAGE, "back wall"),
        box({ RIGHT, 0, BACK }, { RIGHT + 0.1, HEIGHT, FRONT }, PLASTER, "right wall"),
        -- Behind the camera the room is open to a garden, which fills shadows with the sky's even light.
        box({ LEFT - THICK, 0, FRONT }, { LEFT + 0.6, HEIGHT, FRONT + 0.1 }, PLASTER, "front wall"),
        box({ RIGHT - 0.6, 0, FRONT }, { RIGHT, HEIGHT, FRONT + 0.1 }, PLASTER, "front wall"),
        box({ LEFT + 0.6, LINTEL, FRONT }, { RIGHT - 0.6, HEIGHT, FRONT + 0.1 }, PLASTER, "front wall"),
        box({ LEFT - THICK, HEIGHT, BACK - 0.1 }, { RIGHT + 0.1, HEIGHT + 0.1, FRONT + 0.1 }, PLASTER, "ceiling"),
        box({ LEFT, 0, BACK }, { RIGHT, 0.11, BACK + 0.015 }, PAINT, "skirting"),
        box({ RIGHT - 0.015, 0, BACK }, { RIGHT, 0.11, FRONT }, PAINT, "skirting"),
    }
end

-- Cloth that hangs in folds beside a window, from the rail to the floor; folds are deeper below.
local function curtain(from, to)
    local linen = tessera.diffuse { reflectance = tessera.hex("#f4ead7") }
    local geometry = forms.sheet(30, 160, function(row, column)
        local down, across = row / 29, column / 159
        local fold = math.sin(2 * math.pi * 7 * across + 0.6 * math.sin(9 * across)) + 0.3 * math.sin(31 * across + 2 * down)
        return LEFT + 0.11 + (0.025 + 0.03 * down) * fold, 2.5 - 2.47 * down, from + (to - from) * across
    end)
    return forms.mesh(geometry, linen, nil, "curtain")
end

function interior.scene()
    return tessera.scene {
        objects = {
            floor(),
            walls(),
            curtain(-3.1, -2.62),
            curtain(-1.15, -0.3),
            tessera.cylinder { from = { LEFT + 0.11, 2.53, BACK }, to = { LEFT + 0.11, 2.53, FRONT }, radius = 0.016, material = tessera.metal { metal = "brass" }, name = "rail" },
            furniture.rug(0.1, -1.25, 1.55),
            furniture.table(tessera.translate(0, 0, -1.5)),
            furniture.chair(tessera.translate(0.95, 0, -0.95) * tessera.rotate({ 0, 1, 0 }, -38)),
            furniture.chair(tessera.translate(-0.75, 0, -2.15) * tessera.rotate({ 0, 1, 0 }, 155)),
            tableware.tea(tessera.translate(0, 0.75, -1.5)),
            furniture.picture(tessera.translate(0.55, 1.72, BACK + 0.002), 1.15, 0.85),
            furniture.sideboard(tessera.translate(1.75, 0, BACK + 0.24)),
            tableware.plant(tessera.translate(-1.9, 0, -2.6)),
            furniture.pendant(tessera.translate(0, 1.82, -1.5), HEIGHT - 1.82),
        },
        -- Low enough that it reaches the table and the far half of the floor.
        background = tessera.sky { sun = { -1, 0.55, 0.12 }, turbidity = 2.6, ground = { 0.16, 0.2, 0.1 } },
    }
end

return interior
