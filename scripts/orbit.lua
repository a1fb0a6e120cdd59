-- A camera's way around the court of mirrors: a sequence, each frame a job of its own.
local tessera = require("tessera")
local mini = require("scenes.mini_demo")

local LAST = tessera.param("last", 24)
local court = mini.scene { spheres = 12 }

return tessera.job {
    frames = { first = 1, last = LAST },
    scene = court,
    camera = function(frame)
        local angle = 2 * math.pi * (frame - 1) / LAST
        return tessera.perspective { eye = { 10.6 * math.sin(angle), 3.7, 10.6 * math.cos(angle) }, look_at = { 0, 1.1, 0 }, fov = 46 }
    end,
    film = { width = 320, height = 240 },
    quality = { samples = 4 },
}
