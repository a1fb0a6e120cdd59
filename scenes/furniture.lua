-- What stands in the room of `scenes/interior.lua`; one unit is a metre. Each function returns a group, placed by `place`.

local tessera = require("tessera")
local forms = require("scenes.forms")

local furniture = {}

local OAK = tessera.plastic { reflectance = { 0.40, 0.235, 0.115 }, roughness = 0.4 }
local DARK_OAK = tessera.plastic { reflectance = { 0.16, 0.085, 0.045 }, roughness = 0.35 }
local BRASS = tessera.metal { metal = "brass", roughness = 0.25 }

local WHITE = tessera.plastic { reflectance = 0.8, roughness = 0.15 }

local function matte(code) return tessera.diffuse { reflectance = tessera.hex(code) } end

local function placed(place, objects)
    return tessera.instance { group = tessera.group(objects), transform = place }
end

-- A leg that tapers towards the floor, leaning outwards.
local function leg(x, z, lean, height, radius, material)
    return tessera.cone { from = { x, height, z }, to = { x * lean, 0, z * lean }, radius = radius, to_radius = 0.55 * radius, material = material }
end

local function four_legs(objects, x, z, lean, height, radius, material)
    for _, side in { -1, 1 } do
        for _, end_ in { -1, 1 } do
            table.insert(objects, leg(side * x, end_ * z, lean, height, radius, material))
        end
    end
end

-- A round table, 1.3 metres across, with a rounded edge.
function furniture.table(place)
    local top = forms.spline({ { 0, 0.715 }, { 0.60, 0.715 }, { 0.645, 0.725 }, { 0.65, 0.737 }, { 0.64, 0.75 }, { 0.64, 0.75 }, { 0, 0.75 } }, 6)
    local objects = { forms.mesh(forms.lathe(top, 128), OAK, nil, "table top") }
    four_legs(objects, 0.33, 0.33, 1.35, 0.72, 0.035, OAK)
    return placed(place, objects)
end

-- A chair that faces -z: seat, bent back on spindles.
function furniture.chair(place)
    local seat = forms.spline({ { 0, 0.425 }, { 0.20, 0.425 }, { 0.225, 0.44 }, { 0.22, 0.462 }, { 0.17, 0.458 }, { 0, 0.45 } }, 6)
    local objects = { forms.mesh(forms.lathe(seat), DARK_OAK, nil, "seat") }
    four_legs(objects, 0.14, 0.14, 1.5, 0.44, 0.02, DARK_OAK)
    local bow = {}
    for i = 0, 24 do
        local angle = math.pi * i / 24
        table.insert(bow, { 0.21 * math.cos(angle), 0.45 + 0.46 * math.sin(angle) ^ 0.6, 0.12 + 0.13 * math.sin(angle) })
    end
    table.insert(objects, forms.mesh(forms.tube(bow, 0.014), DARK_OAK, nil, "back"))
    for i = -2, 2 do
        table.insert(objects, tessera.cylinder { from = { 0.055 * i, 0.45, 0.17 }, to = { 0.065 * i, 0.905 - 0.012 * i * i, 0.245 }, radius = 0.007, material = DARK_OAK })
    end
    return placed(place, objects)
end

-- Rings of wool.
function furniture.rug(x, z, radius)
    local objects, rings = {}, { "#b5533c", "#efe3cf", "#33506b", "#efe3cf", "#c9a24b" }
    for i, code in rings do
        table.insert(objects, tessera.cylinder {
            from = { x, 0, z }, to = { x, 0.010 + 0.0005 * i, z }, radius = radius * (1 - 0.06 * (i - 1) - (if i == 5 then 0.2 else 0)), material = matte(code), name = "rug",
        })
    end
    return tessera.group(objects)
end

-- A framed picture of sun and hills, cut from coloured paper: each sheet a little in front of the one before. It hangs with its middle at `place`.
function furniture.picture(place, width, height)
    local w, h = width / 2, height / 2
    local objects = {
        tessera.box { min = { -w, -h, 0 }, max = { w, h, 0.012 }, material = matte("#f5efe2"), name = "mount" },
        tessera.box { min = { -0.8 * w, -0.76 * h, 0 }, max = { 0.8 * w, 0.76 * h, 0.013 }, material = matte("#f0d9b0"), name = "sky" },
        tessera.disc { center = { 0.3 * w, 0.22 * h, 0.0135 }, normal = { 0, 0, 1 }, radius = 0.2 * h, material = matte("#d9482b"), name = "sun" },
    }
    for i, code in { "#9cb3b8", "#5f8a94", "#2f5d6b", "#18343f" } do
        local hill = forms.sheet(40, 2, function(row, column)
            local x = -0.8 + 1.6 * row / 39
            local crest = 0.12 - 0.2 * i + 0.16 * math.sin(2.3 * x * (1 + 0.2 * i) + 2 * i) + 0.06 * math.sin(7 * x + i)
            return x * w, (if column == 1 then math.max(crest, -0.75) else -0.76) * h, 0.0135 + 0.0005 * i
        end)
        table.insert(objects, forms.mesh(hill, matte(code), nil, "hill"))
    end
    local wide = 0.035
    for _, side in { -1, 1 } do
        table.insert(objects, tessera.box { center = { side * w, 0, 0.015 }, size = { wide, height + wide, 0.03 }, material = DARK_OAK, name = "frame" })
        table.insert(objects, tessera.box { center = { 0, side * h, 0.015 }, size = { width, wide, 0.03 }, material = DARK_OAK, name = "frame" })
    end
    return placed(place, objects)
end

-- A low cupboard with doors and brass knobs, and books on it.
function furniture.sideboard(place)
    local objects = {
        tessera.box { min = { -0.7, 0.16, -0.2 }, max = { 0.7, 0.74, 0.2 }, material = OAK, name = "sideboard" },
    }
    four_legs(objects, 0.6, 0.15, 1.08, 0.17, 0.022, DARK_OAK)
    for i = -1, 1 do
        table.insert(objects, tessera.box { min = { 0.46 * i - 0.22, 0.185, 0.2 }, max = { 0.46 * i + 0.22, 0.715, 0.212 }, material = OAK, name = "door" })
        table.insert(objects, tessera.sphere { center = { 0.46 * i + 0.17, 0.47, 0.228 }, radius = 0.016, material = BRASS, name = "knob" })
    end
    local random, x = tessera.random(8), -0.6
    local covers = { "#8c2f39", "#2f4858", "#d8a03d", "#33658a", "#ece3d0", "#55734b", "#b5533c" }
    for i = 1, 13 do
        local thick, tall = random:uniform(0.022, 0.05), random:uniform(0.19, 0.28)
        table.insert(objects, tessera.box {
            min = { 0, 0, -0.09 }, max = { thick - 0.002, tall, 0.08 }, material = matte(covers[1 + i % #covers]), name = "book",
            -- The last ones lean against the others.
            transform = tessera.translate(x + (if i > 11 then 0.05 else 0), 0.74, 0) * tessera.rotate({ 0, 0, 1 }, if i > 11 then 14 else 0),
        })
        x += thick
    end
    return placed(place, objects)
end

-- A dome of enamel on a cable; `drop` is the cable's length.
function furniture.pendant(place, drop)
    local dome = forms.spline({ { 0.26, 0 }, { 0.25, 0.06 }, { 0.17, 0.15 }, { 0.05, 0.2 }, { 0.03, 0.26 }, { 0, 0.265 } }, 8)
    return placed(place, {
        forms.mesh(forms.lathe(dome), tessera.plastic { reflectance = tessera.hex("#24464f"), roughness = 0.2 }, nil, "dome"),
        tessera.cylinder { from = { 0, 0.26, 0 }, to = { 0, drop, 0 }, radius = 0.004, material = matte("#202020"), name = "cable" },
        tessera.sphere { center = { 0, 0.07, 0 }, radius = 0.05, material = WHITE, name = "bulb" },
    })
end

return furniture
