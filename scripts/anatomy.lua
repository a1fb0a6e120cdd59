-- Bones and vessels of a hand in translucent resin, lit from behind.
local tessera = require("tessera")
local anatomy = require("scenes.anatomy")

local width = tessera.param("width", 960)

return tessera.job {
  scene   = anatomy.scene { cell = tessera.param("cell", 0.2) },
  camera  = tessera.perspective { eye = {-6, 10, 66}, look_at = {-4.5, 5.4, 0}, fov = 45.5 },
  film    = { width = width, height = width * 9 // 16 },
  render  = tessera.path { max_depth = 64, roulette_depth = 16 },  -- light is scattered many times in the resin before it comes out
  quality = { samples = tessera.param("samples", 384) },
  output  = { exposure = tessera.param("exposure", 0.25) },
}
