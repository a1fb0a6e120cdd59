-- A frame of noise for measuring a coordinator: nobody renders it.
local tessera = require("tessera")

return tessera.job {
  scene = tessera.scene { objects = { tessera.sphere { center = {0, 0, 0}, radius = 1, material = tessera.diffuse { reflectance = 0.5 } } }, background = {0.5, 0.5, 0.5} },
  camera = tessera.perspective { eye = {0, 0, -5}, look_at = {0, 0, 0}, fov = 40 },
  film = { width = tessera.param("width", 1024), height = tessera.param("height", 1024) },
  quality = { samples = 1 },
  split = tessera.split.grid { size = 64 },
  assign = tessera.assign.earliest_finish,
  output = { exr = "scale.exr", png = "scale.png" },
}
