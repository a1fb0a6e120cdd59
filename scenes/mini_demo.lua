-- A court of mirrors: a spiral of spheres on a checkered floor, gems and a golden knot among them, tall mirrors that see
-- each other around, and a glass globe on a column in the middle.

local tessera = require("tessera")
local solids = require("scenes.solids")

local mini = {}

local MIRROR = tessera.mirror { reflectance = { 0.92, 0.93, 0.94 } }
local GOLD = tessera.mirror { reflectance = { 0.95, 0.70, 0.32 } }
local COPPER = tessera.mirror { reflectance = { 0.93, 0.52, 0.38 } }
local GLASS = tessera.glass { ior = 1.5 }
local STONE = tessera.diffuse { reflectance = tessera.hex("#d8d0c4") }
local BRONZE = tessera.diffuse { reflectance = tessera.hex("#6b5335") }

local PALETTE = { "#e4572e", "#f3a712", "#17bebb", "#2e86ab", "#a23b72", "#76b041", "#f6f0e0" }

-- A round terrace: tiles of one unit, warm white and slate, with a stone rim.
local function terrace(radius)
    local tiles = tessera.checker { even = tessera.hex("#e4dccb"), odd = tessera.hex("#35404e"), size = 0.5 / radius }
    local rim = tessera.mesh(solids.with(solids.lathe({ { radius - 0.4, -0.9 }, { radius + 0.25, -0.35 }, { radius + 0.25, 0.06 }, { radius, 0.06 }, { radius, -0.1 } }, 192), {
        material = STONE,
        name = "rim",
    }))
    return {
        tessera.disc { radius = radius, normal = { 0, 1, 0 }, material = tessera.diffuse { reflectance = tiles }, name = "floor" },
        rim,
    }
end

-- Standing mirrors with bronze backs, on an arc behind the court, each turned towards its middle.
local function mirrors(count, radius)
    local group = {}
    for i = 1, count do
        local angle = math.rad(180 + 180 * (i - 0.5) / count)
        local place = tessera.translate { radius * math.cos(angle), 0, radius * math.sin(angle) }
            * tessera.rotate({ 0, 1, 0 }, -90 - math.deg(angle))
        table.insert(group, tessera.box { min = { -1.15, 0.15, 0 }, max = { 1.15, 4.2, 0.06 }, material = MIRROR, transform = place, name = "mirror " .. i })
        table.insert(group, tessera.box { min = { -1.25, 0, -0.12 }, max = { 1.25, 4.3, -0.02 }, material = BRONZE, transform = place })
    end
    return tessera.group(group)
end

-- A column with a globe of glass on it.
local function globe()
    local profile = {
        { 0.62, 0.00 }, { 0.62, 0.10 }, { 0.50, 0.16 }, { 0.44, 0.24 }, { 0.36, 0.34 },
        { 0.33, 0.80 }, { 0.36, 1.06 }, { 0.46, 1.14 }, { 0.50, 1.20 }, { 0.50, 1.26 }, { 0.001, 1.26 },
    }
    return tessera.group {
        tessera.mesh(solids.with(solids.lathe(profile, 96), { material = STONE, name = "column" })),
        tessera.sphere { center = { 0, 2.06, 0 }, radius = 0.8, material = GLASS, name = "globe" },
    }
end

-- What stands on the floor besides the spheres: {x, z, radius that is kept free}.
local KNOT = { -2.75, 2.1, 0.9 }
local GEMS = { { 2.55, 2.3, 0.46 }, { 3.75, 1.1, 0.46 }, { 1.35, 3.55, 0.46 } }
local STONES = {
    { -1.3, 3.5, 0.45, material = tessera.diffuse { reflectance = tessera.hex("#c8352b") }, turn = 20 },
    { 0.25, 3.9, 0.42, material = MIRROR, turn = 55 },
    { -4.1, 3.1, 0.50, material = tessera.diffuse { reflectance = tessera.hex("#1f7a8c") }, turn = 80 },
}

local function is_free(x, z, radius)
    for _, spots in { { KNOT }, GEMS, STONES } do
        for _, spot in spots do
            if (x - spot[1]) ^ 2 + (z - spot[2]) ^ 2 < (radius + spot[3]) ^ 2 then
                return false
            end
        end
    end
    return true
end

-- Spheres on Vogel's spiral around the column, where the floor is free: painted, mirroring and of glass in turn.
local function spiral(count)
    local group, seed = {}, 0
    while #group < count do
        local i = #group
        local radius = 0.24 + 0.07 * (i % 4)
        local rho, angle = 1.05 + 0.78 * math.sqrt(seed + 0.5), 2.399963 * seed + 0.7
        local x, z = rho * math.cos(angle), rho * math.sin(angle)
        seed += 1
        if is_free(x, z, radius) then
            local material = ({
                tessera.diffuse { reflectance = tessera.hex(PALETTE[1 + (i // 3) % #PALETTE]) },
                if i % 2 == 0 then MIRROR else COPPER,
                GLASS,
            })[1 + i % 3]
            table.insert(group, tessera.sphere { center = { x, radius, z }, radius = radius, material = material, name = `sphere {i}` })
        end
    end
    return tessera.group(group)
end

-- Meshes in the foreground: a golden knot, gems of glass, painted and mirroring icosahedra.
local function treasures()
    local group = {
        tessera.mesh(solids.with(solids.torus_knot { major = 0.52, minor = 0.22, tube = 0.105, rows = 384, columns = 32 }, {
            material = GOLD,
            transform = tessera.translate(KNOT[1], 0.78, KNOT[2]) * tessera.rotate({ 1, 0, 0 }, 68),
            name = "knot",
        })),
    }
    local gem = tessera.group { tessera.mesh(solids.with(solids.gem { sides = 9, radius = 0.44, height = 0.78 }, { material = GLASS })) }
    for i, spot in GEMS do
        local place = tessera.translate(spot[1], 0, spot[2]) * tessera.rotate({ 0, 1, 0 }, 37 * i)
        table.insert(group, tessera.instance { group = gem, transform = place, name = `gem {i}` })
    end
    for i, stone in STONES do
        local size = stone[3]
        table.insert(group, tessera.mesh(solids.with(solids.icosahedron(size), {
            material = stone.material,
            transform = tessera.translate(stone[1], 0.8 * size, stone[2]) * tessera.rotate({ 0.3, 1, 0.2 }, stone.turn),
            name = `icosahedron {i}`,
        })))
    end
    return tessera.group(group)
end

-- The whole court; `spheres` is the length of the spiral, `mirrors` the number of standing mirrors.
function mini.scene(options)
    options = options or {}
    return tessera.scene {
        objects = {
            terrace(9),
            mirrors(options.mirrors or 7, 6.2),
            globe(),
            spiral(options.spheres or 30),
            treasures(),
        },
        lights = {
            tessera.point { position = { -5.5, 8.5, 6.5 }, intensity = { 290, 265, 225 }, name = "lamp" },
            tessera.point { position = { 6.0, 5.5, 4.0 }, intensity = { 70, 85, 115 }, name = "window" },
            tessera.directional { direction = { 0.25, -1, -0.35 }, irradiance = { 0.55, 0.55, 0.62 }, name = "sky" },
        },
        background = tessera.hex("#86a9cf"),
    }
end

return mini
