-- What `tessera verify farm --real` renders while it kills: about a second of mirrors and glass.
local tessera = require("tessera")
local objects = { tessera.plane { material = tessera.diffuse { reflectance = tessera.checker { even = 0.8, odd = 0.2, size = 0.5 } } } }
for i = 0, 24 do
  local material = i % 2 == 0 and tessera.mirror { reflectance = 0.9 } or tessera.glass { ior = 1.5 }
  table.insert(objects, tessera.sphere { center = { i % 5 - 2, 0.4, i // 5 - 1 }, radius = 0.4, material = material })
end
return tessera.job {
  scene = tessera.scene {
    objects = objects,
    lights = { tessera.point { position = {-4, 6, -4}, intensity = {120, 115, 105} } },
    background = {0.25, 0.40, 0.70},
  },
  camera  = tessera.perspective { eye = {0, 1.6, -5}, look_at = {0, 0.4, 0}, fov = 50 },
  film    = { width = 256, height = 192 },
  render  = tessera.whitted { max_depth = 8 },
  quality = { samples = 128 },
  split   = tessera.split.grid { size = 32 },
  output  = { exr = "real.exr" },
}
