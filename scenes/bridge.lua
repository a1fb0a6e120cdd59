-- A cable-stayed bridge along z for `scenes/city.lua`, from the near bank at z = 40 to the far one. One unit is a metre.

local tessera = require("tessera")

local bridge = {}

local CONCRETE = tessera.diffuse { reflectance = { 0.30, 0.28, 0.26 } }
local STEEL = tessera.metal { metal = "iron", roughness = 0.4 }
local HEADLIGHT = tessera.emitter { radiance = { 60, 58, 50 } }
local TAILLIGHT = tessera.emitter { radiance = { 40, 2, 1 } }
local FLOODLIGHT = tessera.emitter { radiance = { 420, 300, 180 } }

local NEAR, DECK, WIDE = 40, 9, 6 -- where it begins along z, its height above the water, half of its width
local TALL = 34                   -- of the pylons above the deck

local function rod(from, to, radius, material)
    return tessera.cylinder { from = from, to = to, radius = radius, material = material }
end

-- Two leaning legs that meet above the road, a floodlight at the foot of each, and cables to both sides.
local function pylon(group, z)
    local top = { 0, DECK + TALL, z }
    for _, side in { -1, 1 } do
        local x = side * (WIDE + 1.2)
        table.insert(group, rod({ x, -4, z }, { x, DECK, z }, 1.1, CONCRETE))
        table.insert(group, tessera.cone { from = { x, DECK, z }, to = { 0.5 * side, top[2], z }, radius = 1.1, to_radius = 0.7, material = CONCRETE })
        table.insert(group, tessera.sphere { center = { x * 1.3, DECK + 1, z + 2.5 }, radius = 0.35, material = FLOODLIGHT, name = "floodlight" })
        for cable = 1, 7 do
            for _, way in { -1, 1 } do
                table.insert(group, rod({ 0.5 * side, top[2] - 1.6 * cable, z }, { side * WIDE, DECK, z + way * (46 - 5.5 * cable) }, 0.09, STEEL))
            end
        end
    end
end

-- The bridge, lamps of the given material along it, and the evening's cars.
function bridge.object(place, far, lamp)
    local random = tessera.random(9)
    local group = {
        tessera.box { min = { -WIDE, DECK - 1.2, far }, max = { WIDE, DECK, NEAR }, material = CONCRETE, name = "deck" },
    }
    for _, z in { -45, -140 } do
        pylon(group, z)
    end
    for z = NEAR, far, -12 do
        for _, side in { -1, 1 } do
            table.insert(group, rod({ side * WIDE, DECK, z }, { side * WIDE, DECK + 4, z }, 0.09, STEEL))
            table.insert(group, tessera.sphere { center = { side * WIDE, DECK + 4.2, z }, radius = 0.28, material = lamp, name = "bridge lamp" })
        end
        -- One lane comes, the other goes.
        for _, car in { { -2.4, TAILLIGHT }, { 2.4, HEADLIGHT } } do
            local at = z + random:uniform(-5, 5)
            for _, side in { -0.7, 0.7 } do
                table.insert(group, tessera.sphere { center = { car[1] + side, DECK + 0.8, at }, radius = 0.16, material = car[2], name = "car" })
            end
        end
    end
    return tessera.instance { group = tessera.group(group), transform = place }
end

return bridge
