-- A mountain lake in autumn, a million plants; `groves` (of 14 trees) and `squares` (of 100 tufts) make it smaller or larger.
local tessera = require("tessera")
local landscape = require("scenes.landscape")

local width = tessera.param("width", 960)
local eye = landscape.eye()

return tessera.job {
  scene   = landscape.scene { groves = tessera.param("groves", 7500), squares = tessera.param("squares", 9000) },
  camera  = tessera.perspective { eye = eye, look_at = {eye[1] + 8, eye[2] + 4, -100}, fov = 56 },
  film    = { width = width, height = width * 9 // 16 },
  render  = tessera.path { max_depth = 8 },
  quality = { samples = tessera.param("samples", 96) },
  output  = { exposure = tessera.param("exposure", 1.3) },
}
