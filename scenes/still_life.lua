-- Glass and metal on a dark table: a bottle and a glass of red wine, a golden bowl, a copper jug, grapes. One unit is 10 centimetres.

local tessera = require("tessera")
local forms = require("scenes.forms")

local still_life = {}

-- Where glass and wine overlap, the glass is there: the wine reaches a little into its wall, and no gap of air shows between them.
local GLASS_PRIORITY, WINE_PRIORITY = 2, 1

local WINE = tessera.glass {
    ior = 1.34,
    priority = WINE_PRIORITY,
    interior = tessera.medium { absorption = { 1.1, 7.5, 6.0 }, name = "red wine" },
}
local CLEAR = tessera.glass { ior = 1.52, priority = GLASS_PRIORITY }
local GREEN = tessera.glass {
    ior = 1.52,
    priority = GLASS_PRIORITY,
    interior = tessera.medium { absorption = { 9, 2.2, 10 }, name = "bottle green" },
}
local GOLD = tessera.metal { metal = "gold", roughness = 0.16 }
-- Copper that has darkened a little in air: redder than a fresh cut.
local COPPER = tessera.metal { reflectance = { 0.93, 0.50, 0.34 }, roughness = 0.32 }
local TABLE = tessera.plastic { reflectance = { 0.022, 0.014, 0.010 }, roughness = 0.32 }
local WALL = tessera.diffuse { reflectance = { 0.085, 0.075, 0.082 } }

-- A thin-walled glass: foot, stem and bowl outside, then the bowl's inside back to the middle.
local function wine_glass(place)
    local outside = forms.spline({
        { 0, 0 }, { 0.36, 0 }, { 0.36, 0.02 }, { 0.12, 0.06 }, { 0.05, 0.16 }, { 0.045, 0.5 }, { 0.05, 0.82 },
        { 0.12, 0.93 }, { 0.31, 1.10 }, { 0.42, 1.40 }, { 0.39, 1.72 }, { 0.33, 2.02 },
    }, 8)
    local inside = forms.spline({ { 0.315, 2.02 }, { 0.375, 1.72 }, { 0.405, 1.40 }, { 0.295, 1.12 }, { 0.11, 0.975 }, { 0, 0.95 } }, 8)
    -- The rim is round enough with one point between both walls.
    local profile = outside
    table.insert(profile, { 0.3225, 2.03 })
    table.move(inside, 1, #inside, #profile + 1, profile)
    -- A third full: the surface of the wine lies in the widest part, where a taster wants it.
    local wine = forms.spline({ { 0, 0.94 }, { 0.115, 0.965 }, { 0.303, 1.11 }, { 0.413, 1.40 } }, 8)
    table.insert(wine, { 0.413, 1.40 })
    table.insert(wine, { 0, 1.40 })
    return tessera.group {
        forms.mesh(forms.lathe(profile), CLEAR, place, "wine glass"),
        forms.mesh(forms.lathe(wine), WINE, place, "wine in the glass"),
    }
end

-- A bottle with its wine up to the shoulder, a paper label and a capsule of foil at its neck.
local function bottle(place)
    local outside = forms.spline({ { 0, 0.05 }, { 0.30, 0 }, { 0.38, 0.06 }, { 0.385, 0.3 }, { 0.385, 1.7 }, { 0.36, 1.95 }, { 0.19, 2.22 }, { 0.15, 2.45 }, { 0.15, 2.95 } }, 8)
    local inside = forms.spline({ { 0.105, 2.95 }, { 0.11, 2.45 }, { 0.15, 2.22 }, { 0.32, 1.93 }, { 0.345, 1.7 }, { 0.345, 0.3 }, { 0.32, 0.1 }, { 0, 0.12 } }, 8)
    local profile = outside
    table.move(inside, 1, #inside, #profile + 1, profile)
    local wine = { { 0, 0.10 }, { 0.33, 0.10 }, { 0.355, 0.3 }, { 0.355, 1.55 }, { 0.355, 1.55 }, { 0, 1.55 } }
    local label = { { 0.39, 0.55 }, { 0.39, 1.3 } }
    local capsule = forms.spline({ { 0.156, 2.5 }, { 0.156, 2.98 }, { 0.156, 2.98 }, { 0, 2.98 } }, 4)
    return tessera.group {
        forms.mesh(forms.lathe(profile), GREEN, place, "bottle"),
        forms.mesh(forms.lathe(wine), WINE, place, "wine in the bottle"),
        forms.mesh(forms.lathe(label), tessera.diffuse { reflectance = tessera.hex("#e8dcc0") }, place, "label"),
        forms.mesh(forms.lathe({ { 0.392, 1.12 }, { 0.392, 1.17 } }), GOLD, place, "gilt line"),
        forms.mesh(forms.lathe({ { 0.392, 0.66 }, { 0.392, 0.69 } }), GOLD, place, "gilt line"),
        forms.mesh(forms.lathe(capsule), tessera.metal { reflectance = { 0.35, 0.03, 0.04 }, roughness = 0.35 }, place, "capsule"),
    }
end

local function golden_bowl(place)
    local profile = forms.spline({
        { 0, 0 }, { 0.34, 0 }, { 0.34, 0.04 }, { 0.16, 0.10 }, { 0.16, 0.16 }, { 0.45, 0.28 }, { 0.68, 0.52 }, { 0.74, 0.72 },
        { 0.72, 0.73 }, { 0.64, 0.52 }, { 0.42, 0.32 }, { 0, 0.24 },
    }, 8)
    return forms.mesh(forms.lathe(profile), GOLD, place, "golden bowl")
end

local function copper_jug(place)
    local profile = forms.spline({
        { 0, 0 }, { 0.40, 0 }, { 0.40, 0 }, { 0.56, 0.22 }, { 0.60, 0.52 }, { 0.46, 0.92 }, { 0.28, 1.18 }, { 0.27, 1.38 }, { 0.38, 1.56 },
        { 0.36, 1.56 }, { 0.25, 1.38 }, { 0.26, 1.16 }, { 0.3, 1.05 },
    }, 8)
    local handle = forms.spline({ { 0.3, 1.46, 0 }, { 0.62, 1.52, 0 }, { 0.86, 1.20, 0 }, { 0.76, 0.78, 0 }, { 0.54, 0.62, 0 } }, 10)
    return tessera.group {
        forms.mesh(forms.lathe(profile), COPPER, place, "copper jug"),
        forms.mesh(forms.tube(handle, 0.045), COPPER, place, "handle"),
    }
end

-- Grapes heaped where they find room: each lies as low as those before it let it.
local function grapes(x, z, base, count, spread)
    local random, heap = tessera.random(5), {}
    local skins = {
        tessera.plastic { reflectance = tessera.hex("#4b1f3d"), roughness = 0.35 },
        tessera.plastic { reflectance = tessera.hex("#2d1a3a"), roughness = 0.4 },
        tessera.plastic { reflectance = tessera.hex("#6a2440"), roughness = 0.3 },
    }
    local group = {}
    for i = 1, count do
        local at, radius = random:in_disc(spread), random:uniform(0.10, 0.125)
        local height = base + radius
        for _, below in heap do
            local reach = (radius + below.radius) ^ 2 - (at[1] - below[1]) ^ 2 - (at[3] - below[3]) ^ 2
            height = math.max(height, if reach > 0 then below[2] + math.sqrt(reach) else height)
        end
        table.insert(heap, { at[1], height, at[3], radius = radius })
        table.insert(group, tessera.sphere { center = { x + at[1], height, z + at[3] }, radius = radius, material = skins[1 + i % 3], name = `grape {i}` })
    end
    return tessera.group(group)
end

-- A square lamp of the given size that shines from `place` towards the middle of the table.
local function softbox(name, place, width, height, radiance)
    return tessera.rectangle {
        name = name, center = { 0, 0, 0 }, edge_u = { -width, 0, 0 }, edge_v = { 0, height, 0 },
        material = tessera.emitter { radiance = radiance },
        transform = tessera.look_at(place, { 0, 0.9, 0 }),
    }
end

function still_life.scene()
    return tessera.scene {
        objects = {
            tessera.box { min = { -9, -0.4, -2.4 }, max = { 9, 0, 3.2 }, material = TABLE, name = "table" },
            tessera.rectangle { corner = { -20, -6, -5 }, edge_u = { 40, 0, 0 }, edge_v = { 0, 20, 0 }, material = WALL, name = "wall" },
            bottle(tessera.translate(-1.15, 0, -0.75)),
            wine_glass(tessera.translate(-0.25, 0, 0.25)),
            copper_jug(tessera.translate(1.85, 0, -0.6) * tessera.rotate({ 0, 1, 0 }, -25)),
            golden_bowl(tessera.translate(0.85, 0, 0.35)),
            grapes(0.85, 0.35, 0.34, 26, 0.42),
            grapes(-1.2, 0.7, 0, 7, 0.34),
            -- Key from the left, a weak fill beside the camera, a narrow cool strip from the right for the edges of glass, a warm glow on the wall.
            softbox("key", { -5.5, 4.6, 2.2 }, 4.2, 4.2, { 7.5, 6.9, 6.0 }),
            softbox("fill", { 2.5, 3.6, 6.5 }, 3, 2, { 0.75, 0.8, 0.95 }),
            softbox("strip", { 5.2, 2.6, -2.6 }, 0.9, 4.5, { 5.0, 6.2, 8.0 }),
        },
        lights = {
            tessera.spot { position = { 1.5, 0.2, -3.2 }, look_at = { 0.4, 2.2, -5 }, intensity = { 22, 13, 7.5 }, outer = 70, inner = 5, name = "glow on the wall" },
        },
        background = 0.012,
    }
end

return still_life
