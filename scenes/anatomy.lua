-- A teaching model: bones and vessels of a hand, cast in translucent resin, before a round lamp. One unit is a centimetre.

local tessera = require("tessera")
local forms = require("scenes.forms")
local hand = require("scenes.hand")

local anatomy = {}

local TABLE = -9 -- its height; the forearm stands in a plinth on it

-- Resin: light goes more than three centimetres before it is scattered, mostly forwards, and turns amber on its way.
local RESIN = tessera.glass {
    ior = 1.36,
    roughness = 0.22,
    interior = tessera.medium { absorption = { 0.006, 0.075, 0.17 }, scattering = { 0.28, 0.27, 0.25 }, anisotropy = 0.6, name = "resin" },
}
local BRASS = tessera.metal { metal = "brass", roughness = 0.25 }
local EBONY = tessera.plastic { reflectance = { 0.02, 0.014, 0.011 }, roughness = 0.25 }
local VIAL = tessera.glass { ior = 1.5, priority = 2 }

local function plinth()
    local profile = forms.spline({
        { 5.6, TABLE }, { 5.6, TABLE + 0.7 }, { 5.6, TABLE + 0.7 }, { 5.0, TABLE + 1.1 }, { 4.3, TABLE + 2.2 }, { 4.3, TABLE + 3.2 }, { 4.5, TABLE + 3.6 },
        { 4.5, TABLE + 3.9 }, { 4.5, TABLE + 3.9 }, { 0, TABLE + 3.9 },
    }, 6)
    local ring = forms.spline({ { 4.32, TABLE + 2.4 }, { 4.5, TABLE + 2.5 }, { 4.5, TABLE + 2.9 }, { 4.32, TABLE + 3.0 } }, 5)
    return tessera.group { forms.mesh(forms.lathe(profile, 128), EBONY, nil, "plinth"), forms.mesh(forms.lathe(ring, 128), BRASS, nil, "ring") }
end

-- A vial with a coloured liquid that reaches a little into its wall, and a cork.
local function vial(place, height, absorption)
    local profile = forms.spline({
        { 0, 0 }, { 1.3, 0 }, { 1.5, 0.2 }, { 1.5, height - 1.6 }, { 0.8, height - 0.6 }, { 0.8, height }, { 0.65, height }, { 0.65, height - 0.6 },
        { 1.36, height - 1.7 }, { 1.36, 0.4 }, { 1.2, 0.2 }, { 0, 0.2 },
    }, 6)
    local top = 0.62 * height
    local liquid = tessera.glass { ior = 1.33, priority = 1, interior = tessera.medium { absorption = absorption } }
    local cork = { { 0, height - 0.5 }, { 0.63, height - 0.5 }, { 0.63, height - 0.5 }, { 0.7, height + 0.6 }, { 0.7, height + 0.6 }, { 0, height + 0.6 } }
    return tessera.group {
        forms.mesh(forms.lathe(profile, 64), VIAL, place, "vial"),
        forms.mesh(forms.lathe({ { 0, 0.15 }, { 1.2, 0.15 }, { 1.42, 0.45 }, { 1.42, top }, { 1.42, top }, { 0, top } }, 64), liquid, place, "liquid"),
        forms.mesh(forms.lathe(cork, 48), tessera.diffuse { reflectance = tessera.hex("#a9794c") }, place, "cork"),
    }
end

-- The round lamp behind, in a ring of brass on a foot.
local function lamp()
    local center, radius = { -3.5, 8.5, -16 }, 13.5
    local ring = {}
    for i = 0, 96 do
        local angle = 2 * math.pi * i / 96
        table.insert(ring, { center[1] + (radius + 0.3) * math.cos(angle), center[2] + (radius + 0.3) * math.sin(angle), center[3] })
    end
    return tessera.group {
        tessera.disc { center = center, normal = { 0, 0, 1 }, radius = radius, material = tessera.emitter { radiance = { 1.1, 0.92, 0.7 } }, name = "lamp" },
        forms.mesh(forms.tube(ring, 0.35, 24), BRASS, nil, "ring of the lamp"),
        tessera.cylinder { from = { center[1], TABLE, center[3] }, to = { center[1], center[2] - radius, center[3] }, radius = 0.5, material = BRASS, name = "foot" },
        tessera.cylinder { from = { center[1], TABLE, center[3] }, to = { center[1], TABLE + 0.5, center[3] }, radius = 4, material = BRASS, name = "foot" },
    }
end

-- `cell`: how finely the flesh is made, in centimetres.
function anatomy.scene(options)
    local function on_table(x, z) return tessera.translate(x, TABLE, z) end
    return tessera.scene {
        objects = {
            hand.bones(),
            hand.vessels(),
            hand.flesh(RESIN, options.cell or 0.2),
            plinth(),
            lamp(),
            vial(on_table(-14, -1), 11, { 0.02, 0.35, 0.6 }),
            vial(on_table(-18.5, 1.5), 8, { 0.5, 0.12, 0.03 }),
            vial(on_table(-11.2, 4), 6, { 0.25, 0.03, 0.3 }),
            tessera.box { min = { -60, TABLE - 2, -30 }, max = { 60, TABLE, 30 }, material = EBONY, name = "table" },
            tessera.rectangle { corner = { -120, -60, -45 }, edge_u = { 240, 0, 0 }, edge_v = { 0, 150, 0 }, material = tessera.diffuse { reflectance = { 0.10, 0.16, 0.18 } }, name = "wall" },
            -- A weak window in front shows the surfaces that the lamp does not reach.
            tessera.rectangle {
                center = { 0, 0, 0 }, edge_u = { -40, 0, 0 }, edge_v = { 0, 36, 0 }, material = tessera.emitter { radiance = { 7.5, 8.0, 8.6 } },
                transform = tessera.look_at({ 30, 26, 42 }, { 0, 4, 0 }), name = "fill",
            },
        },
        background = { 0.03, 0.035, 0.045 },
    }
end

return anatomy
