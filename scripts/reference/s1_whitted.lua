-- A reference scene with a known picture: 32 spheres of diffuse colour, mirror and glass on a checkered floor under two lights.
--
-- Its lights do not weaken with distance, its glass casts no shadow, and rays of little weight are cut off, as older ray tracers do by
-- default; here they are options. One sample in the middle of each pixel, so that the picture can be compared number by number.
local tessera = require("tessera")

local mirror = tessera.mirror { reflectance = 0.9 }
local glass  = tessera.glass { ior = 1.5 }

-- Three colours a third of a turn apart.
local function color(k)
  local third = 2 * math.pi / 3
  return { 0.5 + 0.4 * math.cos(k), 0.5 + 0.4 * math.cos(k + third), 0.5 + 0.4 * math.cos(k + 2 * third) }
end

local function material(i)
  if i % 3 == 1 then return mirror end
  if i % 3 == 2 then return glass end
  return tessera.diffuse { reflectance = color(i // 3) }
end

local objects = {
  tessera.plane {
    name = "floor", point = {0, 0, 0}, normal = {0, 1, 0},
    material = tessera.diffuse { reflectance = tessera.checker { even = 0.8, odd = 0.2, size = 1 } },
  },
  tessera.sphere { name = "large mirror", center = {-4.5, 1.6, -6.5}, radius = 1.6, material = mirror },
  tessera.sphere { name = "high glass", center = {1.2, 1.9, 2.5}, radius = 0.6, material = glass },
}

for i = 0, 29 do
  local radius = 0.30 + 0.10 * (i % 4)
  local rho, t = 0.95 * math.sqrt(i + 0.5), 2.399963 * i
  table.insert(objects, tessera.sphere {
    name = `sphere {i}`, center = { rho * math.cos(t), radius, rho * math.sin(t) }, radius = radius, material = material(i),
  })
end

return tessera.job {
  scene = tessera.scene {
    objects = objects,
    lights = {
      tessera.point { position = {-6, 9, 6}, intensity = {0.60, 0.60, 0.60}, falloff = "none" },
      tessera.point { position = {7, 8, 3}, intensity = {0.40, 0.38, 0.35}, falloff = "none" },
    },
    background = {0.25, 0.40, 0.70},
  },
  camera  = tessera.perspective { eye = {0, 3.5, 11}, look_at = {0, 0.8, 0}, up = {0, 1, 0}, fov = 45 },
  film    = { width = 1024, height = 768, filter = "point" },
  render  = tessera.whitted { max_depth = 8, transparent_shadows = true, min_weight = 1 / 255 },
  quality = { samples = 1 },
}
