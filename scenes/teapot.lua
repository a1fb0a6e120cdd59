-- A teapot: a turned body and lid, a spout and a handle. About three units long from handle to spout, along x; it stands on y = 0.

local tessera = require("tessera")
local forms = require("scenes.forms")

local teapot = {}

local BODY = { { 0, 0.04 }, { 0.55, 0 }, { 0.6, 0.06 }, { 0.6, 0.06 }, { 0.85, 0.3 }, { 1.0, 0.75 }, { 0.85, 1.2 }, { 0.55, 1.42 }, { 0.5, 1.44 } }
local LID = { { 0.52, 1.43 }, { 0.5, 1.47 }, { 0.3, 1.58 }, { 0.08, 1.64 }, { 0.06, 1.7 }, { 0.13, 1.78 }, { 0.12, 1.86 }, { 0, 1.9 } }
local SPOUT = { { 0.75, 0.42, 0 }, { 1.15, 0.6, 0 }, { 1.35, 1.05, 0 }, { 1.62, 1.42, 0 } }
local HANDLE = { { -0.7, 1.22, 0 }, { -1.15, 1.42, 0 }, { -1.55, 1.1, 0 }, { -1.4, 0.6, 0 }, { -0.85, 0.38, 0 } }

-- The pot glazed in a colour (a code of `tessera.hex`), with the handle and a ring about the lid of brass.
function teapot.object(place, color)
    local glaze = tessera.plastic { reflectance = tessera.hex(color), roughness = 0.1 }
    local brass = tessera.metal { metal = "brass", roughness = 0.22 }
    local ring = { { 0.53, 1.42 }, { 0.56, 1.43 }, { 0.56, 1.46 }, { 0.52, 1.47 } }
    return tessera.instance {
        transform = place,
        group = tessera.group {
            forms.mesh(forms.lathe(forms.spline(BODY, 10), 128), glaze, nil, "body"),
            forms.mesh(forms.lathe(forms.spline(LID, 8), 96), glaze, nil, "lid"),
            forms.mesh(forms.lathe(forms.spline(ring, 5), 96), brass, nil, "ring"),
            -- The spout narrows quickly where it leaves the body, then slowly.
            forms.mesh(forms.tube(forms.spline(SPOUT, 10), function(t) return 0.11 + 0.2 * (1 - t) ^ 2 end, 32), glaze, nil, "spout"),
            forms.mesh(forms.tube(forms.spline(HANDLE, 12), function(t) return 0.06 + 0.04 * math.sin(math.pi * t) end, 24), brass, nil, "handle"),
        },
    }
end

return teapot
