-- Gradient noise in the plane (Perlin's), and sums of it: the shape of hills, waves and cloth.

local tessera = require("tessera")

local noise = {}

-- A shuffled list of 0 to 255, and a direction for each: what stands at a point of the whole-number grid. It repeats after 256 units.
local numbers, GX, GZ = {}, {}, {}
for i = 0, 255 do
    table.insert(numbers, i)
    GX[i], GZ[i] = math.cos(2 * math.pi * i / 256), math.sin(2 * math.pi * i / 256)
end
local SHUFFLED = tessera.random(1):shuffle(numbers)

local function fade(t)
    return t * t * t * (t * (6 * t - 15) + 10)
end

-- About -0.7 to 0.7, smooth, with hills about one unit wide.
function noise.plane(x, z)
    local cx, cz = math.floor(x), math.floor(z)
    local u, v = x - cx, z - cz
    local left, right = SHUFFLED[cx % 256 + 1], SHUFFLED[(cx + 1) % 256 + 1]
    local a, b = SHUFFLED[(left + cz) % 256 + 1], SHUFFLED[(right + cz) % 256 + 1]
    local c, d = SHUFFLED[(left + cz + 1) % 256 + 1], SHUFFLED[(right + cz + 1) % 256 + 1]
    local na, nb = GX[a] * u + GZ[a] * v, GX[b] * (u - 1) + GZ[b] * v
    local nc, nd = GX[c] * u + GZ[c] * (v - 1), GX[d] * (u - 1) + GZ[d] * (v - 1)
    local s = fade(u)
    local near, far = na + s * (nb - na), nc + s * (nd - nc)
    return near + fade(v) * (far - near)
end

-- Octaves of noise, each of twice the detail and half the height of the one before.
function noise.fractal(x, z, octaves)
    local sum, height = 0, 1
    for _ = 1, octaves do
        sum += height * noise.plane(x, z)
        -- Turned a little and moved, so that the grids of octaves do not show.
        x, z, height = 1.6 * x - 1.2 * z + 17.3, 1.2 * x + 1.6 * z - 9.1, height / 2
    end
    return sum
end

-- The same with sharp crests, 0 to about 2, whose detail gathers on high ground: mountains.
function noise.ridged(x, z, octaves)
    local sum, height, weight = 0, 1, 1
    for _ = 1, octaves do
        local crest = (1 - math.abs(1.6 * noise.plane(x, z))) ^ 2 * weight
        sum += height * crest
        weight = math.clamp(1.4 * crest, 0, 1)
        x, z, height = 1.6 * x - 1.2 * z + 17.3, 1.2 * x + 1.6 * z - 9.1, height / 2
    end
    return sum
end

return noise
