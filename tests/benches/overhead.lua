-- A job of a good twenty seconds on two threads, for measuring what the farm costs.
local tessera = require("tessera")
local mini = require("scenes.mini_demo")

return tessera.job {
  scene = mini.scene { spheres = 30 },
  camera = tessera.perspective { eye = {0.8, 3.7, 10.6}, look_at = {0, 1.1, 0}, fov = 46 },
  film = { width = 1024, height = 768 },
  quality = { samples = tessera.param("samples", 64) },
  assign = tessera.assign.earliest_finish,
}
