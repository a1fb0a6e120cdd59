-- A model on a studio turntable, 36 frames for one turn:  tessera render scripts/turntable.lua --set model=FILE.glb -o DIR
-- One frame alone: --set frame=4. Without a model there is a teapot. The turntable is 3 units across: `scale` fits a model to it, `lift` raises one
-- whose origin is not at its foot.
local tessera = require("tessera")
local studio = require("scenes.studio")
local teapot = require("scenes.teapot")

local STEPS = 36

local width = tessera.param("width", 960)
local scale = tessera.param("scale", 1)
local lift  = tessera.param("lift", 0)

local function subject()
  if tessera.param("model", "") == "" then
    return teapot.object(tessera.scale(0.72), "#b3392f")
  end
  return tessera.model { file = tessera.param_file("model"), transform = tessera.translate(0, lift, 0) * tessera.scale(scale) }
end

local object = subject()

return tessera.job {
  frames  = { first = 1, last = STEPS },
  scene   = function(frame) return studio.scene(object, 30 + 360 * (frame - 1) / STEPS) end,
  camera  = tessera.perspective { eye = {0, 2.5, 6.4}, look_at = {0, 0.45, 0}, fov = 40 },
  film    = { width = width, height = width * 9 // 16 },
  render  = tessera.path { max_depth = 12 },
  quality = { samples = tessera.param("samples", 128) },
  output  = { exposure = tessera.param("exposure", 0.3) },
}
