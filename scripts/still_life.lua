-- Glass and metal on a dark table, through a lens that is sharp at the wine glass.
local tessera = require("tessera")
local still_life = require("scenes.still_life")

local width = tessera.param("width", 960)

return tessera.job {
  scene   = still_life.scene(),
  camera  = tessera.perspective {
    eye = {-0.5, 2.3, 8.7}, look_at = {0.1, 1.4, 0}, fov = 39,
    lens_radius = 0.09, focus_distance = 8.45,         -- to the wine glass, along the axis of view
  },
  film    = { width = width, height = width * 9 // 16 },
  render  = tessera.path { max_depth = 32 },           -- light passes four surfaces of glass to leave a bottle, and as many to come in
  quality = { samples = tessera.param("samples", 256) },
  output  = { exposure = tessera.param("exposure", 0.9) },
}
