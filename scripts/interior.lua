-- A room in the morning, lit by nothing but sun and sky through two windows and an open side behind the camera.
local tessera = require("tessera")
local interior = require("scenes.interior")

local width = tessera.param("width", 960)

return tessera.job {
  scene   = interior.scene(),
  camera  = tessera.perspective { eye = {0.7, 1.5, 2.35}, look_at = {-0.12, 1.02, -2}, fov = 54 },
  film    = { width = width, height = width * 9 // 16 },
  render  = tessera.path { max_depth = 16 },           -- the far corners live on light that walls have passed on many times
  quality = { samples = tessera.param("samples", 512) },
  output  = { exposure = tessera.param("exposure", 3.3) },
}
