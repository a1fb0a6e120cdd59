-- A city at dusk across a river: towers with thousands of lit windows, lamps along the quay and on a bridge. One unit is a metre; the
-- eye is on the near bank at z = 0 and looks along -z, the water's surface is y = 0.

local tessera = require("tessera")
local forms = require("scenes.forms")
local noise = require("scenes.noise")
local bridge = require("scenes.bridge")

local city = {}

local BANK = -190           -- where the far bank begins along z
local QUAY = 5              -- its height above the water
local FLOOR, BAY = 3.4, 2.7 -- height of a storey, distance of windows

-- Light of lamps and windows, relative to each other: warm rooms, offices, the blue of screens.
local WINDOWS = {
    tessera.emitter { radiance = { 2.6, 1.55, 0.65 } },
    tessera.emitter { radiance = { 3.4, 2.3, 1.2 } },
    tessera.emitter { radiance = { 1.5, 0.8, 0.3 } },
    tessera.emitter { radiance = { 2.1, 2.2, 2.1 } },
    tessera.emitter { radiance = { 0.6, 0.9, 1.4 } },
}
local LAMP = tessera.emitter { radiance = { 80, 48, 20 } }
local BEACON = tessera.emitter { radiance = { 30, 1.5, 1 } }

local WALLS = {
    tessera.plastic { reflectance = { 0.055, 0.065, 0.085 }, roughness = 0.2 },
    tessera.plastic { reflectance = { 0.09, 0.08, 0.075 }, roughness = 0.35 },
    tessera.diffuse { reflectance = { 0.20, 0.17, 0.14 } },
    tessera.diffuse { reflectance = { 0.14, 0.135, 0.14 } },
}

-- Lit windows on one side of a block: `corner` is its lower left seen from outside, `along` the unit direction to the right.
local function windows(group, random, corner, along, width, height, share)
    -- A house has its own habits: whole storeys of offices, or single rooms.
    local by_storey = random:uniform() < 0.4
    local columns = math.floor(width / BAY)
    local margin = (width - columns * BAY) / 2
    for storey = 1, math.floor(height / FLOOR) - 1 do
        local busy = not by_storey or random:uniform() < 0.6
        local tone = random:choice(WINDOWS)
        for column = 0, columns - 1 do
            if busy and random:uniform() < share * (if by_storey then 1.5 else 1) then
                local right = margin + BAY * column + 0.6
                -- A little in front of the wall, which would cover it.
                table.insert(group, tessera.rectangle {
                    corner = { corner[1] + along[1] * right + 0.04 * along[3], corner[2] + FLOOR * storey, corner[3] + along[3] * right + 0.04 * along[1] },
                    edge_u = { along[1] * 1.6, 0, along[3] * 1.6 }, edge_v = { 0, 1.8, 0 },
                    material = if by_storey then tone else random:choice(WINDOWS),
                })
            end
        end
    end
end

-- A block from the ground up, with windows on its front and on the side that faces the middle of the picture.
local function block(group, random, x, z, width, depth, base, height, wall, share)
    table.insert(group, tessera.box { min = { x - width / 2, base, z - depth }, max = { x + width / 2, base + height, z }, material = wall })
    windows(group, random, { x - width / 2, base, z }, { 1, 0, 0 }, width, height, share)
    if x < 0 then
        windows(group, random, { x + width / 2, base, z }, { 0, 0, -1 }, depth, height, share)
    else
        windows(group, random, { x - width / 2, base, z - depth }, { 0, 0, 1 }, depth, height, share)
    end
end

-- A tower in one to three steps, the higher ones with a mast and a red light.
local function tower(group, random, x, z, width, height, share)
    local wall, base, steps = random:choice(WALLS), QUAY, if height > 60 then random:integer(2, 3) else 1
    for step = 1, steps do
        local part = if step == steps then QUAY + height - base else height * random:uniform(0.3, 0.42)
        block(group, random, x, z - 2.5 * step, width, width, base, part, wall, share)
        base, width = base + part, width * random:uniform(0.62, 0.8)
    end
    if height > 85 then
        local middle = { x, base, z - 2.5 * steps - width / 2 }
        table.insert(group, tessera.cone { from = middle, to = { x, base + 0.22 * height, middle[3] }, radius = 1, to_radius = 0.1, material = WALLS[1] })
        table.insert(group, tessera.sphere { center = { x, base + 0.22 * height, middle[3] }, radius = 0.7, material = BEACON, name = "beacon" })
    end
end

-- Heights follow a skyline: a high cluster at the right third, a lower one at the left, houses between them.
local function skyline(x, row)
    local high = 125 * math.exp(-((x - 95) / 75) ^ 2) + 70 * math.exp(-((x + 190) / 70) ^ 2)
    return (22 + high) * (0.75 + 0.13 * row)
end

local function towers(share)
    local random, group = tessera.random(17), {}
    for row = 0, 4 do
        local z, x = BANK - 26 - 48 * row, -330 - 40 * row
        while x < 330 + 40 * row do
            local width = random:uniform(16, 30)
            tower(group, random, x + width / 2, z - random:uniform(0, 10), width, skyline(x, row) * random:uniform(0.55, 1.2), share)
            x += width + random:uniform(2, 9)
        end
    end
    return tessera.group(group)
end

-- Lamps along the water and in the streets behind: their posts stand on the quay.
local function lamps()
    local group, post = {}, tessera.diffuse { reflectance = 0.03 }
    for x = -330, 330, 11 do
        table.insert(group, tessera.cylinder { from = { x, QUAY, BANK - 3 }, to = { x, QUAY + 5, BANK - 3 }, radius = 0.12, material = post })
        table.insert(group, tessera.sphere { center = { x, QUAY + 5.4, BANK - 3 }, radius = 0.5, material = LAMP, name = "lamp" })
        for street = 1, 3 do
            table.insert(group, tessera.sphere { center = { x + 4 * street, QUAY + 7, BANK - 22 - 48 * street }, radius = 0.45, material = LAMP, name = "street lamp" })
        end
    end
    return tessera.group(group)
end

-- Water: points closer together near the eye, with ripples longer across the view than along it.
local function river()
    local rows, columns = 220, 500
    local sheet = forms.sheet(rows, columns, function(row, column)
        local z = 40 - (40 - BANK) * (1 - column / (columns - 1)) ^ 1.8
        local x = (2 * row / (rows - 1) - 1) * (60 + 1.3 * (40 - z))
        return x, 0.10 * noise.fractal(x / 5, z / 2.6, 3), z
    end)
    return forms.mesh(sheet, tessera.plastic { reflectance = { 0.004, 0.009, 0.012 }, ior = 1.33, roughness = 0.2 }, nil, "river")
end

-- `share`: how many of the windows are lit.
function city.scene(options)
    local stone = tessera.diffuse { reflectance = { 0.12, 0.11, 0.10 } }
    return tessera.scene {
        objects = {
            towers(options.share or 0.33),
            lamps(),
            river(),
            tessera.box { min = { -900, -3, BANK - 700 }, max = { 900, QUAY, BANK }, material = stone, name = "far bank" },
            bridge.object(tessera.translate(-45, 0, 0) * tessera.rotate({ 0, 1, 0 }, -12), BANK - 30, LAMP),
        },
        -- The sun has set behind the city; the scale makes the sky's last light as bright as its windows.
        background = tessera.sky { sun = { 0.35, -0.055, -1 }, turbidity = 3, scale = options.sky or 60 },
    }
end

return city
