-- What is laid on the table of `scenes/interior.lua`, and its plants; one unit is a metre. Each function returns a group, placed by `place`.

local tessera = require("tessera")
local forms = require("scenes.forms")
local teapot = require("scenes.teapot")

local tableware = {}

local WHITE = tessera.plastic { reflectance = { 0.8, 0.78, 0.74 }, roughness = 0.15 }

local function glazed(code) return tessera.plastic { reflectance = tessera.hex(code), roughness = 0.12 } end
local function matte(code) return tessera.diffuse { reflectance = tessera.hex(code) } end

local function placed(place, objects)
    return tessera.instance { group = tessera.group(objects), transform = place }
end

local function cup(place)
    local profile = forms.spline({ { 0, 0.012 }, { 0.026, 0.01 }, { 0.03, 0.02 }, { 0.044, 0.05 }, { 0.047, 0.075 }, { 0.044, 0.075 }, { 0.04, 0.05 }, { 0.025, 0.022 }, { 0, 0.02 } }, 5)
    local saucer = forms.spline({ { 0, 0 }, { 0.045, 0 }, { 0.08, 0.014 }, { 0.08, 0.017 }, { 0.045, 0.007 }, { 0, 0.006 } }, 5)
    local handle = forms.spline({ { 0.045, 0.065, 0 }, { 0.072, 0.062, 0 }, { 0.07, 0.035, 0 }, { 0.038, 0.03, 0 } }, 6)
    return placed(place, {
        forms.mesh(forms.lathe(profile, 48), WHITE),
        forms.mesh(forms.lathe(saucer, 48), WHITE),
        forms.mesh(forms.tube(handle, 0.005, 8), WHITE),
        tessera.disc { center = { 0, 0.06, 0 }, radius = 0.042, material = glazed("#7a3b12"), name = "tea" },
    })
end

-- A vase with branches in blossom.
local function bouquet(place)
    local vase = forms.spline({ { 0, 0 }, { 0.05, 0 }, { 0.05, 0 }, { 0.085, 0.07 }, { 0.09, 0.13 }, { 0.045, 0.22 }, { 0.035, 0.27 }, { 0.05, 0.30 }, { 0.045, 0.30 }, { 0.03, 0.27 }, { 0.03, 0.2 } }, 6)
    local objects = { forms.mesh(forms.lathe(vase), glazed("#1f5f73"), nil, "vase") }
    local random = tessera.random(3)
    local bark, petals = matte("#4a3a2a"), { matte("#f3c6c9"), matte("#fbeceb"), matte("#e58f9b") }
    for branch = 1, 9 do
        local angle, reach = 2.4 * branch, random:uniform(0.12, 0.3)
        local tip = { reach * math.cos(angle), random:uniform(0.55, 0.78), reach * math.sin(angle) }
        local curve = forms.spline({ { 0, 0.1, 0 }, { 0.1 * tip[1], 0.3, 0.1 * tip[3] }, { 0.5 * tip[1], 0.3 + 0.55 * (tip[2] - 0.3), 0.5 * tip[3] }, tip }, 8)
        table.insert(objects, forms.mesh(forms.tube(curve, function(t) return 0.005 * (1 - 0.7 * t) end, 6), bark))
        for i = 10, #curve do
            for _ = 1, 2 do
                local off = random:in_sphere(0.028)
                local center = { curve[i][1] + off[1], curve[i][2] + off[2], curve[i][3] + off[3] }
                table.insert(objects, tessera.sphere { center = center, radius = random:uniform(0.008, 0.017), material = random:choice(petals) })
            end
        end
    end
    return placed(place, objects)
end

-- What is on the table.
function tableware.tea(place)
    local bowl = forms.spline({ { 0, 0 }, { 0.06, 0 }, { 0.06, 0.01 }, { 0.12, 0.05 }, { 0.14, 0.085 }, { 0.133, 0.085 }, { 0.11, 0.052 }, { 0, 0.02 } }, 6)
    local objects = {
        bouquet(tessera.translate(-0.12, 0, -0.18)),
        cup(tessera.translate(0.3, 0, 0.26) * tessera.rotate({ 0, 1, 0 }, -30)),
        cup(tessera.translate(-0.38, 0, 0.1) * tessera.rotate({ 0, 1, 0 }, 190)),
        teapot.object(tessera.translate(0.1, 0, 0.18) * tessera.rotate({ 0, 1, 0 }, 205) * tessera.scale(0.1), "#e9e2d0"),
        forms.mesh(forms.lathe(bowl), glazed("#c98b3a"), tessera.translate(0.34, 0, -0.12), "bowl"),
    }
    for i = 0, 4 do
        local angle, high = 2 * math.pi * i / 4, i == 4
        local center = { 0.34 + (if high then 0 else 0.05 * math.cos(angle)), if high then 0.125 else 0.072, -0.12 + (if high then 0 else 0.05 * math.sin(angle)) }
        table.insert(objects, tessera.sphere { center = center, radius = 0.036, material = tessera.plastic { reflectance = tessera.hex("#e8801a"), roughness = 0.45 }, name = "orange" })
    end
    return placed(place, objects)
end


-- A large plant in a pot: long leaves that bend under their weight.
function tableware.plant(place)
    local pot = forms.spline({ { 0, 0 }, { 0.14, 0 }, { 0.14, 0 }, { 0.19, 0.3 }, { 0.2, 0.34 }, { 0.18, 0.34 }, { 0.17, 0.3 }, { 0, 0.29 } }, 5)
    local objects = { forms.mesh(forms.lathe(pot), matte("#b8643f"), nil, "pot") }
    local random = tessera.random(21)
    local greens = { matte("#3f6b3a"), matte("#2f5a34"), matte("#5a8445") }
    for leaf = 1, 34 do
        local length, lean, wide = random:uniform(0.5, 1.0), random:uniform(0.15, 1.1), random:uniform(0.03, 0.05)
        local blade = forms.sheet(14, 3, function(row, column)
            local t, side = row / 13, column - 1
            local bend = lean * t * (1 + 0.9 * t)
            local width = wide * math.sin(math.pi * (0.04 + 0.96 * t)) ^ 0.7
            return length * t * math.sin(bend), 0.28 + length * t * math.cos(bend) + 0.25 * width * math.abs(side), width * side
        end)
        table.insert(objects, forms.mesh(blade, greens[1 + leaf % 3], tessera.rotate({ 0, 1, 0 }, 137.5 * leaf), "leaf"))
    end
    return placed(place, objects)
end

return tableware
