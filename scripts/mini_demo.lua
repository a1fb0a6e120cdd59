-- Mirrors, glass and a checkered floor in the spirit of the scenes that distributed ray tracing was first measured on.
local tessera = require("tessera")
local mini    = require("scenes.mini_demo")          -- scenes/mini_demo.lua

return tessera.job {
  scene   = mini.scene { spheres = tessera.param("spheres", 30) },
  camera  = tessera.perspective { eye = {0.8, 3.7, 10.6}, look_at = {0, 1.1, 0}, fov = 46 },
  film    = { width = tessera.param("width", 1024), height = tessera.param("height", 768) },
  render  = tessera.whitted { max_depth = 8 },        -- raycast | whitted
  quality = { samples = tessera.param("samples", 4) },
  probe   = tessera.probe.shared { scale = 1 / 16 },  -- or probe.every_node (the paper's), or probe.from("last.manifest.json")
  split   = tessera.split.grid { size = 64 },         -- or split.strips, or a function
  assign  = function(parts, nodes)                    -- parts hardest first, nodes most powerful first
    local plan, load = {}, {}
    for _, part in parts do                           -- each to the node that would be done with it first
      local best, soonest = nil, math.huge
      for _, node in nodes do
        local finish = ((load[node.id] or 0) + part.cost) / node.power
        if finish < soonest then best, soonest = node.id, finish end
      end
      plan[part.id] = best
      load[best] = (load[best] or 0) + part.cost
    end
    return plan
  end,
  output  = { exr = "mini_demo.exr", png = "mini_demo.png" },
}
