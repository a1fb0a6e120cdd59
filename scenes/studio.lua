-- A photographer's studio: a grey sweep that bends up behind a turntable, three softboxes. The turntable is 3 units across, its top at y = 0.

local tessera = require("tessera")
local forms = require("scenes.forms")

local studio = {}

local PAPER = tessera.diffuse { reflectance = { 0.42, 0.43, 0.45 } }
local BLACK = tessera.plastic { reflectance = 0.018, roughness = 0.3 }
local STEEL = tessera.metal { metal = "aluminium", roughness = { 0.2, 0.45 } }

-- Floor, bend and wall in one sheet of paper: rows go from the back to the front, so that it faces up and forwards.
local function sweep()
    local floor, wall, bend = -0.32, -4.5, 2.5
    local profile = { { wall, 9 } }
    for i = 0, 16 do
        local angle = math.pi / 2 * i / 16
        table.insert(profile, { wall + bend * (1 - math.cos(angle)), floor + bend * (1 - math.sin(angle)) })
    end
    table.insert(profile, { 9, floor })
    local sheet = forms.sheet(2, #profile, function(row, column)
        return -14 + 28 * row, profile[column + 1][2], profile[column + 1][1]
    end)
    return forms.mesh(sheet, PAPER, nil, "sweep")
end

-- The plate turns; its marks of ten degrees show how far.
local function plate(angle)
    local edge = forms.spline({ { 0, -0.14 }, { 1.45, -0.14 }, { 1.5, -0.12 }, { 1.5, -0.02 }, { 1.48, 0 }, { 1.48, 0 }, { 0, 0 } }, 5)
    local objects = { forms.mesh(forms.lathe(edge, 180), BLACK, nil, "plate") }
    for mark = 0, 35 do
        local wide = if mark % 9 == 0 then 0.03 else 0.012
        table.insert(objects, tessera.box {
            min = { 1.36, 0, -wide }, max = { 1.44, 0.002, wide }, material = STEEL, transform = tessera.rotate({ 0, 1, 0 }, 10 * mark), name = "mark",
        })
    end
    return tessera.instance { group = tessera.group(objects), transform = tessera.rotate({ 0, 1, 0 }, angle) }
end

local function foot()
    return forms.mesh(forms.lathe({ { 1.2, -0.32 }, { 1.2, -0.15 }, { 1.2, -0.15 }, { 0, -0.15 } }, 128), STEEL, nil, "foot")
end

local function softbox(name, place, width, height, radiance)
    return tessera.rectangle {
        name = name, center = { 0, 0, 0 }, edge_u = { -width, 0, 0 }, edge_v = { 0, height, 0 },
        material = tessera.emitter { radiance = radiance }, transform = tessera.look_at(place, { 0, 0.6, 0 }),
    }
end

-- The studio with an object on the turntable, turned by `angle` degrees.
function studio.scene(object, angle)
    return tessera.scene {
        objects = {
            sweep(),
            foot(),
            plate(angle),
            tessera.instance { group = tessera.group { object }, transform = tessera.rotate({ 0, 1, 0 }, angle) },
            -- Key from the left and above, weak fill from the right, and a rim light from behind that draws the outline.
            softbox("key", { -4.2, 4.6, 3.6 }, 3, 3, { 8, 7.6, 7 }),
            softbox("fill", { 5.5, 2.4, 3.5 }, 3, 3, { 1.2, 1.35, 1.6 }),
            softbox("rim", { 3.4, 4.2, -3.4 }, 2.4, 1.2, { 9, 10, 12 }),
        },
        background = 0.03,
    }
end

return studio
