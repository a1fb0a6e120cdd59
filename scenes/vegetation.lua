-- Plants of few triangles for `scenes/landscape.lua`, in groups that are placed many times. One unit is a metre; plants stand on y = 0.

local tessera = require("tessera")
local forms = require("scenes.forms")
local noise = require("scenes.noise")

local vegetation = {}

local function matte(code) return tessera.diffuse { reflectance = tessera.hex(code) } end

-- A conifer: skirts of needles, each a ragged cone that hangs down, around a trunk.
local function conifer(random, height, width, needles)
    local positions, triangles = {}, {}
    local function vertex(x, y, z)
        for _, number in { x, y, z } do table.insert(positions, number) end
        return #positions // 3 - 1
    end
    local skirts, points = 13, 11
    for skirt = 0, skirts - 1 do
        local t = skirt / skirts
        local top, reach = height * (0.24 + 0.76 * (t + 1.3 / skirts)), width * (1 - t) ^ 0.85 + 0.12
        local tip, turn = vertex(0, math.min(top, height), 0), random:uniform(0, 6)
        local rim = {}
        for i = 0, 2 * points - 1 do
            local angle = turn + math.pi * i / points
            local out = reach * (if i % 2 == 0 then random:uniform(0.8, 1.1) else 0.55)
            table.insert(rim, vertex(out * math.cos(angle), height * (0.14 + 0.76 * t) - 0.22 * out, out * math.sin(angle)))
        end
        for i, corner in rim do
            for _, k in { tip, rim[i % #rim + 1], corner } do table.insert(triangles, k) end
        end
    end
    local trunk = tessera.cone { from = { 0, -1, 0 }, to = { 0, 0.8 * height, 0 }, radius = 0.025 * height, material = matte("#3b2d22"), capped = false }
    return tessera.group { forms.mesh(forms.smooth(positions, triangles), needles), trunk }
end

-- A grove: trees of six shapes within a circle; `golden` is the share of the shapes that are larches in autumn.
function vegetation.grove(seed, count, radius, golden)
    local random = tessera.random(seed)
    local dark = { matte("#1d3320"), matte("#26402a"), matte("#182b20") }
    local larch = { matte("#b98a2e"), matte("#a5702a"), matte("#c79b3c") }
    local kinds, trees = {}, {}
    for i = 1, 6 do
        local needles = if random:uniform() < golden then larch[1 + i % 3] else dark[1 + i % 3]
        kinds[i] = conifer(random, random:uniform(13, 22), random:uniform(2.4, 3.4), needles)
    end
    for _ = 1, count do
        local at = random:in_disc(radius)
        local size = random:uniform(0.45, 1.1)
        table.insert(trees, tessera.instance {
            group = random:choice(kinds),
            transform = tessera.translate(at) * tessera.rotate({ 0, 1, 0 }, random:uniform(0, 360)) * tessera.scale(size),
        })
    end
    return tessera.group(trees)
end

-- A tuft: blades that bend outwards, two triangles each; perhaps with a flower on a stalk.
local function tuft(random, blade, petal)
    local positions, triangles = {}, {}
    local function vertex(x, y, z)
        for _, number in { x, y, z } do table.insert(positions, number) end
        return #positions // 3 - 1
    end
    for _ = 1, 11 do
        local angle, height, lean = random:uniform(0, 6.283), random:uniform(0.16, 0.42), random:uniform(0.04, 0.2)
        local c, s, wide = math.cos(angle), math.sin(angle), 0.009
        local a, b = vertex(-wide * s, 0, wide * c), vertex(wide * s, 0, -wide * c)
        local m = vertex(0.3 * lean * c + wide * s, 0.6 * height, 0.3 * lean * s - wide * c)
        local tip = vertex(lean * c, height, lean * s)
        for _, k in { a, b, m, a, m, tip } do table.insert(triangles, k) end
    end
    local group = { forms.mesh(forms.smooth(positions, triangles), blade) }
    if petal then
        table.insert(group, tessera.sphere { center = { 0.03, 0.4, 0.02 }, radius = 0.028, material = petal })
    end
    return tessera.group(group)
end

-- A square of meadow with the given edge: tufts, in some squares every ninth in flower.
function vegetation.meadow(seed, count, edge)
    local random = tessera.random(seed)
    local blades = { matte("#5d7a2c"), matte("#748c35"), matte("#46662a"), matte("#93964a") }
    local petals = { matte("#f4e9c6"), matte("#e8b923"), matte("#d2452f"), matte("#7d6bc4") }
    local kinds, tufts = {}, {}
    for i = 1, 9 do
        kinds[i] = tuft(random, blades[1 + i % 4], if i == 9 and seed > 3 then petals[1 + seed % 4] else nil)
    end
    for _ = 1, count do
        table.insert(tufts, tessera.instance {
            group = random:choice(kinds),
            transform = tessera.translate(random:uniform(-edge / 2, edge / 2), 0, random:uniform(-edge / 2, edge / 2))
                * tessera.rotate({ 0, 1, 0 }, random:uniform(0, 360)) * tessera.scale(random:uniform(0.7, 1.5)),
        })
    end
    return tessera.group(tufts)
end

-- A boulder, about one metre across: a ball with a coarse and a fine unevenness.
function vegetation.boulder(seed)
    local rows, columns = 16, 24
    local ball = forms.sheet(rows, columns, function(row, column)
        local up, around = math.pi * row / (rows - 1), 2 * math.pi * column / columns
        local x, y, z = math.sin(up) * math.cos(around), -math.cos(up), -math.sin(up) * math.sin(around)
        local radius = 0.5 + 0.3 * noise.plane(1.3 * x + 9 * seed, 1.3 * z + 1.1 * y) + 0.12 * noise.plane(4 * x + y, 4 * z - 3 * y + seed)
        return 1.2 * radius * x, 0.8 * radius * y, radius * z
    end, true)
    return tessera.group { forms.mesh(ball, matte("#7b766c"), nil, "boulder") }
end

return vegetation
