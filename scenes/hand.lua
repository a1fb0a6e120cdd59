-- The bones and vessels of a right hand, its palm towards +z, and its flesh. One unit is a centimetre; the wrist is at the origin,
-- the fingers point up.

local tessera = require("tessera")
local blob = require("scenes.blob")
local forms = require("scenes.forms")

local hand = {}

local IVORY = tessera.plastic { reflectance = { 0.80, 0.70, 0.52 }, roughness = 0.4 }
local ARTERY = tessera.plastic { reflectance = { 0.65, 0.03, 0.02 }, roughness = 0.3 }
local VEIN = tessera.plastic { reflectance = { 0.03, 0.10, 0.55 }, roughness = 0.3 }

-- Joints from the wrist to the tip, the thumb first. The fingers bend a little towards the palm.
local RAYS = {
    { { -1.7, 1.3, 0.3 }, { -4.3, 4.2, 1.0 }, { -6.0, 6.9, 1.3 }, { -7.0, 9.4, 1.3 } },
    { { -1.2, 2.0, 0 }, { -2.6, 8.5, 0 }, { -3.5, 12.8, 0.3 }, { -3.9, 15.4, 0.7 }, { -4.1, 17.4, 1.2 } },
    { { -0.3, 2.1, 0 }, { -0.7, 8.9, 0 }, { -0.9, 13.7, 0.2 }, { -0.95, 16.7, 0.6 }, { -0.95, 18.9, 1.1 } },
    { { 0.6, 2.0, 0 }, { 1.2, 8.5, 0 }, { 1.8, 12.9, 0.3 }, { 2.1, 15.7, 0.8 }, { 2.25, 17.8, 1.3 } },
    { { 1.4, 1.7, 0 }, { 2.9, 7.6, 0.1 }, { 4.1, 11.0, 0.4 }, { 4.7, 13.0, 0.8 }, { 5.1, 14.8, 1.2 } },
}
local CARPALS = {
    { -1.5, 0.5, 0.7 }, { -0.5, 0.3, 0.65 }, { 0.5, 0.35, 0.6 }, { 1.3, 0.6, 0.5 },
    { -1.4, 1.25, 0.5 }, { -0.7, 1.3, 0.45 }, { 0.05, 1.35, 0.6 }, { 0.95, 1.2, 0.6 },
}
local ELBOW = -16 -- where the forearm ends

-- A bone between two joints: a slender shaft, knobs at both ends; the last one of a finger ends in a blunt tip.
local function bone(from, to, thick, tip)
    local length = math.sqrt((to[1] - from[1]) ^ 2 + (to[2] - from[2]) ^ 2 + (to[3] - from[3]) ^ 2)
    local profile = forms.spline({
        { 0, 0.02 * length }, { 0.7 * thick, 0.03 * length }, { thick, 0.1 * length }, { 0.62 * thick, 0.28 * length }, { 0.5 * thick, 0.55 * length },
        { 0.6 * thick, 0.78 * length }, { (if tip then 0.5 else 0.85) * thick, 0.9 * length }, { 0.5 * thick, 0.97 * length }, { 0, 0.985 * length },
    }, 6)
    -- `look_at` turns -z towards the far joint; a lathe's y is turned there first.
    return forms.mesh(forms.lathe(profile, 32), IVORY, tessera.look_at(from, to, { 0, 0, 1 }) * tessera.rotate({ 1, 0, 0 }, -90), "bone")
end

function hand.bones()
    local group = {
        bone({ -1.0, ELBOW, 0 }, { -0.9, 0, 0 }, 1.0),
        bone({ 1.2, ELBOW, 0 }, { 1.1, -0.1, 0 }, 0.75),
    }
    for finger, joints in RAYS do
        local thick = if finger == 1 then 0.62 elseif finger == 5 then 0.45 else 0.55
        for i = 1, #joints - 1 do
            table.insert(group, bone(joints[i], joints[i + 1], thick * (1 - 0.1 * i), i == #joints - 1))
        end
    end
    for _, c in CARPALS do
        table.insert(group, tessera.sphere { center = { c[1], c[2], 0 }, radius = c[3], material = IVORY, name = "carpal" })
    end
    return tessera.group(group)
end

-- A vessel beside the joints of a finger: `side` is how far beside, `front` how far towards the palm.
local function along(joints, side, front, stem)
    local points = table.clone(stem)
    for i = 2, #joints do
        local shrink = 1 - 0.12 * (i - 2)
        table.insert(points, { joints[i][1] + side * shrink, joints[i][2] - (if i == #joints then 0.5 else 0), joints[i][3] + front })
    end
    return forms.spline(points, 10)
end

-- Arteries at the palm's side, veins at the back: a trunk each in the forearm, from which a branch goes into every finger.
function hand.vessels()
    local group = {}
    local function thinner(from) return function(t) return from * (1 - 0.75 * t) end end
    for _, joints in RAYS do
        local first = joints[1]
        local red = along(joints, 0.42, 0.42, { { -0.2, ELBOW, 0.9 }, { -0.4, -4, 1.0 }, { 0.3 * first[1], 1, 1.0 }, { 0.5 * (first[1] + joints[2][1]), 4.2, 0.8 } })
        local blue = along(joints, -0.42, -0.38, { { 0.3, ELBOW, -0.9 }, { 0.5, -4, -0.9 }, { 0.4 * first[1], 1.2, -0.9 }, { 0.5 * (first[1] + joints[2][1]), 4.0, -0.8 } })
        table.insert(group, forms.mesh(forms.tube(red, thinner(0.24), 10), ARTERY, nil, "artery"))
        table.insert(group, forms.mesh(forms.tube(blue, thinner(0.26), 10), VEIN, nil, "vein"))
    end
    return tessera.group(group)
end

-- The flesh of the given material; `cell` is how finely it is made.
function hand.flesh(material, cell)
    local strokes = { { { 0, ELBOW, 0 }, { 0, 0, 0 }, 2.9, 2.3 }, { { -1.2, 1, 0.2 }, { -3.2, 4.6, 0.6 }, 1.5, 1.3 } }
    for finger, joints in RAYS do
        local thick = if finger == 1 then 1.2 elseif finger == 5 then 0.92 else 1.05
        for i = 1, #joints - 1 do
            local palm = if i == 1 then 0.35 else 0
            table.insert(strokes, { joints[i], joints[i + 1], thick * (1.02 - 0.06 * i) + palm, thick * (0.98 - 0.06 * i) + 0.4 * palm })
        end
    end
    return forms.mesh(blob.mesh(strokes, { low = { -9, ELBOW - 3.5, -3.2 }, high = { 7, 20.6, 3.6 }, cell = cell, melt = 0.7, flat = 1.1 }), material, nil, "flesh")
end

return hand
