-- A reference scene with a known picture: a knot of a million triangles of rough metal on a grey square, under an even sky and a small bright sphere.
local tessera = require("tessera")

local samples = tessera.param("samples", 64)
local seed    = tessera.param("seed", 0)

local ROWS, COLUMNS = 2048, 256

-- The point of a torus knot's axis at parameter t, and the direction from there to the axis's own ring.
local P, Q, R, r = 2, 3, 0.95, 0.42

local function axis(t)
  local cp, sp, cq, sq = math.cos(P * t), math.sin(P * t), math.cos(Q * t), math.sin(Q * t)
  local nx, ny, nz = cq * cp, sq, cq * sp
  return R * cp + r * nx, r * ny, R * sp + r * nz, nx, ny, nz
end

-- The direction of the axis.
local function tangent(t)
  local cp, sp, cq, sq = math.cos(P * t), math.sin(P * t), math.cos(Q * t), math.sin(Q * t)
  local x = -P * R * sp + r * (-Q * sq * cp - P * cq * sp)
  local y = r * Q * cq
  local z = P * R * cp + r * (-Q * sq * sp + P * cq * cp)
  local length = math.sqrt(x * x + y * y + z * z)
  return x / length, y / length, z / length
end

local positions = buffer.create(ROWS * COLUMNS * 12)
local triangles = buffer.create(ROWS * COLUMNS * 2 * 12)

for i = 0, ROWS - 1 do
  local t = 2 * math.pi * i / ROWS
  local cx, cy, cz, nx, ny, nz = axis(t)
  local tx, ty, tz = tangent(t)
  local bx, by, bz = ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx
  local coarse, fine = 0.10 * math.sin(40 * t), 0.015 * math.cos(400 * t)
  for j = 0, COLUMNS - 1 do
    local a = 2 * math.pi * j / COLUMNS
    local d = 0.20 * (1 + coarse * math.cos(5 * a) + 0.04 * math.sin(170 * t + 9 * a) + fine * math.sin(60 * a))
    local c, s = d * math.cos(a), d * math.sin(a)
    local at = (i * COLUMNS + j) * 12
    buffer.writef32(positions, at, cx + c * nx + s * bx)
    buffer.writef32(positions, at + 4, cy + c * ny + s * by + 1.2)
    buffer.writef32(positions, at + 8, cz + c * nz + s * bz)
  end
end

-- Two triangles for each square of the grid, which closes in both directions.
for i = 0, ROWS - 1 do
  local this, next = i * COLUMNS, ((i + 1) % ROWS) * COLUMNS
  for j = 0, COLUMNS - 1 do
    local k = (j + 1) % COLUMNS
    local at = (i * COLUMNS + j) * 24
    buffer.writeu32(triangles, at, this + j)
    buffer.writeu32(triangles, at + 4, next + k)
    buffer.writeu32(triangles, at + 8, next + j)
    buffer.writeu32(triangles, at + 12, this + j)
    buffer.writeu32(triangles, at + 16, this + k)
    buffer.writeu32(triangles, at + 20, next + k)
  end
end

return tessera.job {
  scene = tessera.scene {
    objects = {
      tessera.rectangle {
        name = "ground", corner = {-20, 0, 20}, edge_u = {40, 0, 0}, edge_v = {0, 0, -40},
        material = tessera.diffuse { reflectance = 0.5 },
      },
      tessera.sphere { name = "lamp", center = {3, 5, 2.5}, radius = 0.25, material = tessera.emitter { radiance = {150, 135, 110} } },
      -- Its reflectance is the same at all angles, and light that facets reflect to each other is left out, as the reference does.
      tessera.mesh {
        name = "knot", positions = positions, triangles = triangles,
        material = tessera.metal { reflectance = {0.90, 0.60, 0.30}, fresnel = "constant", roughness = 0.3, multiple_scattering = false },
      },
    },
    background = {0.40, 0.50, 0.60},
  },
  camera  = tessera.perspective { eye = {0, 2.2, 6}, look_at = {0, 1.1, 0}, fov = 40 },
  film    = { width = 960, height = 540 },
  render  = tessera.path { max_depth = 8 },
  quality = { samples = samples },
  seed    = seed,
}
