-- Shows a model file, framed by itself:  tessera render scripts/model.lua --set model=FILE.glb -o DIR
local tessera = require("tessera")

local file = tessera.param_file("model")              -- .glb, .gltf, .obj or .ply
local size = tessera.param("size", 800)

return tessera.job {
  scene = tessera.scene {
    objects = { tessera.model { file = file } },
    lights = {
      tessera.directional { direction = {-0.55, -1.0, -0.75}, irradiance = {2.6, 2.5, 2.3} },
      tessera.directional { direction = {1.0, -0.35, -0.4}, irradiance = {0.6, 0.7, 0.9} },
      tessera.directional { direction = {0.2, 0.6, 1.0}, irradiance = {0.35, 0.35, 0.4} },
    },
    background = {0.75, 0.80, 0.88},
  },
  film    = { width = size, height = size },
  render  = tessera.whitted { max_depth = 6 },
  quality = { samples = tessera.param("samples", 16) },
}
