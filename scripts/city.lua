-- A city at dusk across a river: about eight thousand windows and lamps, each of them a light source.
local tessera = require("tessera")
local city = require("scenes.city")

local width = tessera.param("width", 960)

return tessera.job {
  scene   = city.scene { share = tessera.param("share", 0.33), sky = tessera.param("sky", 60) },
  camera  = tessera.perspective { eye = {0, 13, 62}, look_at = {6, 33, -190}, fov = 58 },
  film    = { width = width, height = width * 9 // 16 },
  render  = tessera.path { max_depth = 6 },
  quality = { samples = tessera.param("samples", 128) },
  output  = { exposure = tessera.param("exposure", 0) },
}
