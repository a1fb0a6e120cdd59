-- A reference scene with a known picture: a room with coloured walls, a box, a glass and a mirror sphere under one small lamp.
local tessera = require("tessera")

local samples = tessera.param("samples", 64)
local seed    = tessera.param("seed", 0)

local white  = tessera.diffuse { reflectance = {0.725, 0.71, 0.68} }
local red    = tessera.diffuse { reflectance = {0.63, 0.065, 0.05} }
local green  = tessera.diffuse { reflectance = {0.14, 0.45, 0.091} }
local lamp   = tessera.emitter { radiance = {17, 12, 4} }

-- Walls of the room [-1, 1]^3, which is open at z = 1, by a corner and two edges.
local function wall(name, corner, edge_u, edge_v, material)
  return tessera.rectangle { name = name, corner = corner, edge_u = edge_u, edge_v = edge_v, material = material }
end

return tessera.job {
  scene = tessera.scene {
    objects = {
      wall("floor",      {-1, -1,  1}, {2, 0, 0}, {0, 0, -2}, white),
      wall("ceiling",    {-1,  1, -1}, {2, 0, 0}, {0, 0,  2}, white),
      wall("back wall",  {-1, -1, -1}, {2, 0, 0}, {0, 2,  0}, white),
      wall("left wall",  {-1, -1,  1}, {0, 0, -2}, {0, 2, 0}, red),
      wall("right wall", { 1, -1, -1}, {0, 0,  2}, {0, 2, 0}, green),
      -- Its normal, edge_u x edge_v, points down: it shines on that side alone.
      wall("lamp", {-0.25, 0.999, -0.25}, {0.5, 0, 0}, {0, 0, 0.5}, lamp),
      tessera.box {
        name = "box", center = {0, 0, 0}, size = {0.6, 1.2, 0.6}, material = white,
        transform = tessera.translate(-0.35, -0.4, -0.35) * tessera.rotate({0, 1, 0}, 17),
      },
      tessera.sphere { name = "glass", center = {0.45, -0.65, 0.25}, radius = 0.35, material = tessera.glass { ior = 1.5 } },
      tessera.sphere { name = "mirror", center = {-0.45, -0.70, 0.50}, radius = 0.30, material = tessera.mirror { reflectance = 0.9 } },
    },
  },
  camera  = tessera.perspective { eye = {0, 0, 3.9}, look_at = {0, 0, 0}, fov = 40 },
  film    = { width = 512, height = 512 },
  render  = tessera.path { max_depth = 16 },
  quality = { samples = samples },
  seed    = seed,
}
