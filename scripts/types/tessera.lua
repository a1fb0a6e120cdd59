---@meta tessera
-- The API of Tessera's job scripts for lua-language-server. The reference, with units and defaults, is scripts/README.md.
-- A line `-- @api NAME` begins what is said of one function; a test holds these blocks to the program.

---@alias tessera.Vec3 number[]
---@alias tessera.Color number|number[]
---@alias tessera.Wrap "repeat"|"mirror"|"clamp"
---@alias buffer userdata

---@class tessera.Object
---@class tessera.Group: tessera.Object
---@class tessera.Material
---@class tessera.Texture
---@class tessera.Medium
---@class tessera.Environment
---@class tessera.Medium
---@class tessera.Environment
---@class tessera.Light
---@class tessera.Camera
---@class tessera.Integrator
---@class tessera.Probe
---@class tessera.Split
---@class tessera.Assign
---@class tessera.Scene
---@class tessera.Job
---@class tessera.Transform
---@operator mul(tessera.Transform): tessera.Transform

---@class tessera.Rect
---@field x integer
---@field y integer
---@field width integer
---@field height integer

---@class tessera.Part: tessera.Rect
---@field id integer
---@field cost number

---@class tessera.Node
---@field id integer
---@field name string
---@field lanes integer
---@field power number

---@class tessera.Costs
---@field cell integer
---@field columns integer
---@field rows integer
---@field seconds_per_pixel number[]
---@field seconds fun(rect: tessera.Rect): number

---@alias tessera.SplitFunction fun(frame: {width: integer, height: integer}, costs: tessera.Costs, nodes: tessera.Node[]): tessera.Rect[]
---@alias tessera.AssignFunction fun(parts: tessera.Part[], nodes: tessera.Node[]): table<integer, integer>

---@alias tessera.SceneFunction fun(frame: integer): tessera.Scene
---@alias tessera.CameraFunction fun(frame: integer): tessera.Camera

---@class tessera.Random
local random = {}

local tessera = { probe = {}, split = {}, assign = {} }

-- @api job: film
---@class tessera.Film
---@field width number columns
---@field height number rows; the first is the top
---@field filter? "box"|"point"|"gaussian"|"blackman_harris"|"mitchell" what a pixel averages

-- @api job: quality
---@class tessera.Quality
---@field samples number samples in every pixel
---@field first? number number of the first of them

-- @api job: output
---@class tessera.Output
---@field exr? string the picture, scene-linear
---@field png? string|false a preview; false: none
---@field pixel_type? "float"|"half" 32 or 16 bits a number in the EXR
---@field exposure? number brightness of the preview: radiance is multiplied by 2^exposure
---@field aovs? ("albedo"|"normal"|"depth"|"position"|"object"|"material"|"samples"|"error"|"residual")[] what the EXR tells of each pixel beside its colour

-- @api job: frames
---@class tessera.Frames
---@field first number number of the first frame
---@field last number no frame has a higher number
---@field step? number distance of the numbers
---@field in_order? boolean whether each frame waits until the one before it is finished

-- @api job
---@class tessera.JobKeys
---@field scene tessera.Scene|tessera.SceneFunction what is there: tessera.scene
---@field camera? tessera.Camera|tessera.CameraFunction from where it is seen: tessera.perspective
---@field film tessera.Film size of the frame: below
---@field render? tessera.Integrator how light is followed
---@field quality? tessera.Quality how accurately: below
---@field probe? tessera.Probe how costs are learned
---@field split? tessera.Split|tessera.SplitFunction how the frame becomes parts
---@field assign? tessera.Assign|tessera.AssignFunction who renders which part
---@field output? tessera.Output what is written: below
---@field seed? number chooses the sample pattern
---@field audit? number share of the parts that two nodes render, to compare their pixels
---@field attempts? number how often a part may fail before it is cut up
---@field patience? number seconds that the job waits for a node when there is none
---@field frames? tessera.Frames|number[] the frames of a sequence

---What the script returns.
---@param keys tessera.JobKeys
---@return tessera.Job
function tessera.job(keys) end

-- @api scene
---@class tessera.SceneKeys
---@field objects (tessera.Object|tessera.Object[])[] shapes, models, groups, instances; lists within lists are taken in place
---@field lights? (tessera.Light|tessera.Light[])[] lights without extent, in world coordinates
---@field background? tessera.Color|tessera.Environment radiance of rays that leave the scene; it lights the scene with path alone
---@field medium? tessera.Medium what fills space outside of everything, for path: fog
---@field name? string for messages

---@param keys tessera.SceneKeys
---@return tessera.Scene
function tessera.scene(keys) end

-- @api sphere
---@class tessera.SphereKeys
---@field center? tessera.Vec3 middle
---@field radius? number radius
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---Its uv are longitude and latitude about y, each in [0, 1]: u = 0.5 faces +z and grows towards +x, v = 0 is +y.
---@param keys tessera.SphereKeys
---@return tessera.Object
function tessera.sphere(keys) end

-- @api plane
---@class tessera.PlaneKeys
---@field point? tessera.Vec3 any point of it
---@field normal? tessera.Vec3 perpendicular to it; any length
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---An infinite plane. Its uv are scene units along two axes of it: x and z for the normal {0, 1, 0}.
---@param keys tessera.PlaneKeys
---@return tessera.Object
function tessera.plane(keys) end

-- @api box
---@class tessera.BoxKeys
---@field min? tessera.Vec3 corner with the lowest coordinates
---@field max? tessera.Vec3 corner with the highest; above min in each
---@field center? tessera.Vec3 middle, with size
---@field size? tessera.Vec3 lengths of the edges
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---Along the axes of its coordinates. Give min and max, or size and perhaps center.
---@param keys tessera.BoxKeys
---@return tessera.Object
function tessera.box(keys) end

-- @api disc
---@class tessera.DiscKeys
---@field center? tessera.Vec3 middle
---@field normal? tessera.Vec3 perpendicular to it; any length
---@field radius? number radius
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---A flat circle. Its uv run from 0 to 1 across the diameter: seen from its front with +y up, u to the right and v down.
---@param keys tessera.DiscKeys
---@return tessera.Object
function tessera.disc(keys) end

-- @api rectangle
---@class tessera.RectangleKeys
---@field corner? tessera.Vec3 where both edges begin
---@field center? tessera.Vec3 middle, instead of corner
---@field edge_u tessera.Vec3 one edge
---@field edge_v tessera.Vec3 the other, not parallel to it
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---A flat rectangle, or a parallelogram where its edges are not perpendicular, from a corner or about its center. Seen from its front, edge_v is counter-clockwise from edge_u; where they point up and right, an image stands upright. Its uv run from 0 to 1, u along edge_u, v against edge_v.
---@param keys tessera.RectangleKeys
---@return tessera.Object
function tessera.rectangle(keys) end

-- @api cylinder
---@class tessera.CylinderKeys
---@field from? tessera.Vec3 middle of one end
---@field to? tessera.Vec3 middle of the other end
---@field radius? number radius
---@field capped? boolean whether discs close the ends
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---A round cylinder. The uv of its side are longitude about the axis (with `to` up, 0.5 faces +z, or +y where it lies along z) and the place along it, v = 0 at `to`; those of its ends are a disc's.
---@param keys tessera.CylinderKeys
---@return tessera.Object
function tessera.cylinder(keys) end

-- @api cone
---@class tessera.ConeKeys
---@field from? tessera.Vec3 middle of one end
---@field to? tessera.Vec3 middle of the other end
---@field radius? number radius at from
---@field to_radius? number radius at to; 0 is an apex
---@field capped? boolean whether discs close the ends
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---A round cone; truncated, if no radius is 0. Its uv are those of a cylinder.
---@param keys tessera.ConeKeys
---@return tessera.Object
function tessera.cone(keys) end

-- @api mesh
---@class tessera.MeshKeys
---@field positions tessera.Vec3[]|buffer vertices
---@field triangles number[][]|buffer corners of each triangle
---@field normals? tessera.Vec3[]|buffer one for each vertex; any length but 0
---@field uvs? number[][]|buffer one for each vertex
---@field material tessera.Material what it is made of
---@field transform? tessera.Transform places it
---@field name? string for messages

---Triangles, counter-clockwise seen from the front. From **tables**, vertices are counted from 1, as Lua does. From Luau **buffers** (32-bit floats, 32-bit unsigned integers, little-endian, without gaps), from 0, as files do; buffers make large meshes fast. A mesh that stands in several places belongs into a group with instances.
---@param keys tessera.MeshKeys
---@return tessera.Object
function tessera.mesh(keys) end

-- @api model
---@class tessera.ModelKeys
---@field file string the file
---@field material? tessera.Material replaces every material of the file
---@field transform? tessera.Transform places it
---@field name? string for messages

---A file made elsewhere, with its own hierarchy and materials: glTF 2.0 (.glb, .gltf), Wavefront OBJ with MTL (.obj), Stanford PLY (.ply). The files that it refers to are collected with it; they lie in its folder or below. What it asks for that is not modelled becomes a warning.
---@param keys tessera.ModelKeys
---@return tessera.Object
function tessera.model(keys) end

-- @api group
---@class tessera.GroupKeys
---@field [integer] tessera.Object|tessera.Object[]
---@field name? string for messages

---Objects in a list, placed together: tessera.group { a, b, c }. Put among objects, it stands at its own place; with tessera.instance it stands anywhere, any number of times, at the cost of one. Groups may hold groups, 32 deep.
---@param keys? tessera.GroupKeys
---@return tessera.Group
function tessera.group(keys) end

-- @api instance
---@class tessera.InstanceKeys
---@field group tessera.Group what is placed
---@field transform? tessera.Transform where
---@field name? string for messages

---@param keys tessera.InstanceKeys
---@return tessera.Object
function tessera.instance(keys) end

-- @api translate
---@param x number|tessera.Vec3 along x
---@param y number along y
---@param z number along z
---@return tessera.Transform
function tessera.translate(x, y, z) end

-- @api rotate
---Counter-clockwise, seen with the axis pointing at you. Quarter turns are exact.
---@param axis tessera.Vec3 what it turns about; any length
---@param degrees number how far
---@return tessera.Transform
function tessera.rotate(axis, degrees) end

-- @api scale
---tessera.scale(2) scales alike in all directions. Negative factors mirror.
---@param x number|tessera.Vec3 factor along x
---@param y? number factor along y
---@param z? number factor along z
---@return tessera.Transform
function tessera.scale(x, y, z) end

-- @api look_at
---Moves the origin to eye and turns -z towards target, as a camera of glTF stands.
---@param eye tessera.Vec3 where the origin goes
---@param target tessera.Vec3 where -z looks
---@param up? tessera.Vec3 towards which y turns as far as it can
---@return tessera.Transform
function tessera.look_at(eye, target, up) end

-- @api matrix
---@param rows number[][] the map by rows; the last column moves. It must be invertible
---@return tessera.Transform
function tessera.matrix(rows) end

-- @api diffuse
---@class tessera.DiffuseKeys
---@field reflectance? tessera.Color|tessera.Texture the share of light that is reflected: the albedo
---@field roughness? number 0 is Lambertian
---@field name? string for messages

---Lambertian reflection, on both sides; with a roughness, that of a rough matte surface such as clay, which keeps its energy (an Oren-Nayar model). Radiance towards the eye is reflectance / pi times irradiance.
---@param keys? tessera.DiffuseKeys
---@return tessera.Material
function tessera.diffuse(keys) end

-- @api mirror
---@class tessera.MirrorKeys
---@field reflectance? tessera.Color the share of light that is reflected
---@field name? string for messages

---Perfect specular reflection, on both sides, alike at every angle: no Fresnel.
---@param keys? tessera.MirrorKeys
---@return tessera.Material
function tessera.mirror(keys) end

-- @api metal
---@class tessera.MetalKeys
---@field metal? string one whose measured index of refraction is known
---@field eta? tessera.Color real part of the index of refraction, for red, green and blue
---@field k? tessera.Color its imaginary part, the absorption
---@field reflectance? tessera.Color what is reflected straight on
---@field fresnel? "schlick"|"constant" how reflectance changes with the angle: up to white at grazing angles (Schlick's approximation), or not at all
---@field roughness? number|number[] perceptual roughness; 0 is smooth. Two: along u and across it, for brushed metal
---@field multiple_scattering? boolean whether light that facets reflect to each other is kept; false loses energy at high roughness, as many programs do
---@field name? string for messages

---A metal, smooth or rough, on both sides: microfacets of the distribution GGX (Trowbridge-Reitz), Smith's height-correlated shadowing. Its alpha is the square of roughness, as in glTF and Blender. Give one of: metal; eta and k; reflectance, perhaps with fresnel.
---@param keys? tessera.MetalKeys
---@return tessera.Material
function tessera.metal(keys) end

-- @api glass
---@class tessera.GlassKeys
---@field ior? number index of refraction of the inside, relative to vacuum
---@field roughness? number perceptual roughness of its surface, for path; 0 is smooth
---@field reflectance? tessera.Color multiplies what is reflected
---@field transmittance? tessera.Color multiplies what is refracted, once at every surface
---@field interior? tessera.Medium what fills it, for path: colours it by thickness
---@field priority? number where closed objects of glass overlap, the one of highest priority is there and the borders of the others do not show (give a glass a higher one than the water: their faces may lie in the same place, or the water's a little within the glass); of equal ones, that which the ray entered last
---@field multiple_scattering? boolean as for metals
---@field name? string for messages

---A dielectric: reflects and refracts by Fresnel's equations. Its shape should be closed; the normal points out of the glass. It blocks the straight way to lights: behind it, path finds that of lamps and suns that have a size (caustics), not that of mere points; whitted finds it where it has transparent_shadows.
---@param keys? tessera.GlassKeys
---@return tessera.Material
function tessera.glass(keys) end

-- @api plastic
---@class tessera.PlasticKeys
---@field reflectance? tessera.Color|tessera.Texture albedo of the base
---@field ior? number index of refraction of the coat
---@field roughness? number perceptual roughness of the coat; 0 is smooth
---@field name? string for messages

---A smooth or rough clear coat over a Lambertian base, on both sides: paint, varnished wood, glazed clay. Light that the coat reflects back to the base is kept.
---@param keys? tessera.PlasticKeys
---@return tessera.Material
function tessera.plastic(keys) end

-- @api metallic_roughness
---@class tessera.MetallicRoughnessKeys
---@field base_color? tessera.Color|tessera.Texture colour of the metal, of what is below the gloss, and of what is seen through it
---@field metallic? number how much of it is a metal
---@field roughness? number perceptual roughness; 0 is smooth
---@field metallic_roughness? tessera.Texture multiplies both: roughness in green, metal in blue, linear
---@field normal? tessera.Texture small bumps: directions in the frame of u, of what is up on the image, and of the normal, from -1 to 1 as linear numbers from 0 to 1
---@field normal_scale? number how strong they are
---@field emissive? tessera.Color|tessera.Texture radiance that it gives off by itself
---@field ior? number index of refraction of what is no metal
---@field specular? number strength of the reflection of what is no metal
---@field specular_color? tessera.Color its colour, straight on
---@field transmission? number the share of light that gets through what is no metal, tinted by base_color
---@field volume? boolean whether the surface is closed and full, and so refracts; otherwise it is a thin wall
---@field attenuation_color? tessera.Color what is left of white light inside after attenuation_distance
---@field attenuation_distance? number see there
---@field clearcoat? number the share of it that a coat of varnish covers
---@field clearcoat_roughness? number perceptual roughness of the coat
---@field clearcoat_normal? tessera.Texture bumps of the coat, which does not have those of normal
---@field clearcoat_normal_scale? number how strong they are
---@field sheen_color? tessera.Color colour of fibres on top, such as those of velvet
---@field sheen_roughness? number their perceptual roughness
---@field anisotropy? number how much reflections are stretched
---@field anisotropy_rotation? number along which direction, counter-clockwise from that of u
---@field name? string for messages

---The material of glTF, by glTF's names and with its defaults: a metal, or a dielectric with light scattered below its gloss or let through, or a mixture, perhaps under fibres, perhaps under a coat of varnish; on both sides. raycast and whitted draw it diffuse in its base colour. Textures that hold numbers need color_space = "linear".
---@param keys? tessera.MetallicRoughnessKeys
---@return tessera.Material
function tessera.metallic_roughness(keys) end

-- @api emitter
---@class tessera.EmitterKeys
---@field radiance tessera.Color|tessera.Texture power per area and steradian: a surface that fills a pixel shows this number
---@field two_sided? boolean whether the other side shines too
---@field name? string for messages

---Shines, the same in all directions, and reflects nothing. Every shape may have it; path sends rays to spheres, discs, rectangles, boxes and meshes of it, and finds others by chance. It shines on the side that the normal points to: out of closed shapes, and of a rectangle on the side from which edge_v is counter-clockwise from edge_u (along edge_u x edge_v).
---@param keys tessera.EmitterKeys
---@return tessera.Material
function tessera.emitter(keys) end

-- @api boundary
---@class tessera.BoundaryKeys
---@field interior tessera.Medium what fills it
---@field name? string for messages

---The invisible border of a medium, for path: smoke in a box. Its shape should be closed.
---@param keys tessera.BoundaryKeys
---@return tessera.Material
function tessera.boundary(keys) end

-- @api medium
---@class tessera.MediumKeys
---@field absorption? tessera.Color what is lost
---@field scattering? tessera.Color what goes on in other directions
---@field anisotropy? number mean cosine of the angle of scattering (Henyey-Greenstein): above 0 forwards, below 0 backwards
---@field name? string for messages

---What fills space, for path: absorbs and scatters light evenly along its way. Coefficients are per scene unit: after a length d, exp(-(absorption + scattering) d) of the light is left on its way. For clear coloured glass that shows colour c at thickness d, absorption = -ln(c) / d.
---@param keys? tessera.MediumKeys
---@return tessera.Medium
function tessera.medium(keys) end

-- @api checker
---@class tessera.CheckerKeys
---@field even? tessera.Color colour of the even squares
---@field odd? tessera.Color colour of the odd squares
---@field size? number edge of a square in units of uv
---@field name? string for messages

---Squares of two colours: even where floor(u / size) + floor(v / size) is even.
---@param keys? tessera.CheckerKeys
---@return tessera.Texture
function tessera.checker(keys) end

-- @api gradient
---@class tessera.GradientKeys
---@field from? tessera.Color colour at start
---@field to? tessera.Color colour at end
---@field start? number[] where it begins
---@field end? number[] where it ends, elsewhere; the defaults go up where v = 0 lies at the top
---@field name? string for messages

---A colour that changes evenly along a line in uv, and stays the same across it and beyond its ends.
---@param keys? tessera.GradientKeys
---@return tessera.Texture
function tessera.gradient(keys) end

-- @api noise
---@class tessera.NoiseKeys
---@field low? tessera.Color colour where it is lowest
---@field high? tessera.Color colour where it is highest
---@field size? number distance of the largest clouds in units of uv
---@field octaves? number how fine it gets
---@field seed? number chooses the pattern
---@field name? string for messages

---Clouds of two colours: Perlin's gradient noise, several octaves of it, each of half the size and half the strength of the one before.
---@param keys? tessera.NoiseKeys
---@return tessera.Texture
function tessera.noise(keys) end

-- @api image
---@class tessera.ImageKeys
---@field file string the file
---@field color_space? "srgb"|"linear" how its numbers are coded
---@field wrap? tessera.Wrap|tessera.Wrap[] what lies beyond its edges in u and v
---@field filter? "bilinear"|"trilinear" how it is interpolated
---@field scale? number|number[] what u and v are multiplied by: 1
---@field offset? number[] what is added to u and v then: { 0, 0 }
---@field name? string for messages

---A picture file: PNG, JPEG or Radiance HDR. Its first row lies at v = 0, as in glTF.
---@param keys tessera.ImageKeys
---@return tessera.Texture
function tessera.image(keys) end

-- @api rgb
---@param r number red, linear
---@param g number green, linear
---@param b number blue, linear
---@return number[]
function tessera.rgb(r, g, b) end

-- @api srgb
---@param r number red as displays code it (IEC 61966-2-1)
---@param g number green
---@param b number blue
---@return number[]
function tessera.srgb(r, g, b) end

-- @api hex
---@param code string "#rrggbb" or "#rgb", sRGB, as on web pages; # may be left out
---@return number[]
function tessera.hex(code) end

-- @api point
---@class tessera.PointKeys
---@field position tessera.Vec3 where it is, in the world
---@field intensity tessera.Color power per steradian: a white diffuse surface that faces it at distance r shows radiance intensity / (pi r^2)
---@field falloff? "inverse_square"|"none" "none": such a surface shows radiance intensity at any distance; for comparison with older ray tracers
---@field name? string for messages

---@param keys tessera.PointKeys
---@return tessera.Light
function tessera.point(keys) end

-- @api directional
---@class tessera.DirectionalKeys
---@field direction tessera.Vec3 the direction in which the light travels; any length
---@field irradiance tessera.Color on a surface that faces it; a white diffuse one shows radiance irradiance / pi
---@field angle? number full angle across which it is spread evenly, for path: soft shadows, and a disc that is seen; the sun's is 0.533
---@field name? string for messages

---@param keys tessera.DirectionalKeys
---@return tessera.Light
function tessera.directional(keys) end

-- @api spot
---@class tessera.SpotKeys
---@field position tessera.Vec3 where it is, in the world
---@field direction? tessera.Vec3 the middle of the cone; any length
---@field look_at? tessera.Vec3 a point in the middle of the cone
---@field intensity tessera.Color power per steradian inside of the inner cone, as for tessera.point
---@field outer? number angle between the middle and where it is dark: half of what a lamp's data sheet may call its angle
---@field inner? number angle between the middle and where it begins to weaken: by 3 x^2 - 2 x^3 of the cosine between both
---@field name? string for messages

---A point light that shines into a cone. Give direction or look_at.
---@param keys tessera.SpotKeys
---@return tessera.Light
function tessera.spot(keys) end

-- @api environment
---@class tessera.EnvironmentKeys
---@field file string .hdr (Radiance, linear), .png or .jpg (sRGB)
---@field scale? tessera.Color multiplies its radiance
---@field rotation? number turns it about +y, counter-clockwise seen from above
---@field name? string for messages

---A picture of the surroundings, in latitude and longitude: its middle column lies in the direction -z, right of it +x (a quarter of the width), its first row in +y. With path it lights the scene; rays are sent to its bright places.
---@param keys tessera.EnvironmentKeys
---@return tessera.Environment
function tessera.environment(keys) end

-- @api sky
---@class tessera.SkyKeys
---@field sun? tessera.Vec3 towards the sun; any length. Below the horizon: dusk
---@field turbidity? number haze: 2 is very clear, 3 usual, 10 hazy
---@field ground? tessera.Color albedo of the ground that is seen below the horizon
---@field scale? number multiplies all radiance
---@field disc? boolean whether the sun itself is there; false: the sky alone
---@field name? string for messages

---A clear sky over a grey ground, with the sun's disc, from the physics of air and haze. Unit: a white diffuse surface that faces the sun outside of the atmosphere would show radiance 1; in the sun it shows about 0.8 (1 unit is 433 W/(m² sr)). +y is up.
---@param keys? tessera.SkyKeys
---@return tessera.Environment
function tessera.sky(keys) end

-- @api perspective
---@class tessera.PerspectiveKeys
---@field eye tessera.Vec3 where it stands
---@field look_at? tessera.Vec3 what falls on the middle of the film; differs from eye
---@field up? tessera.Vec3 what is upright on the film; not parallel to the view
---@field fov? number full **horizontal** field of view
---@field lens_radius? number radius of the lens's opening in scene units; 0 is a pinhole, for which everything is sharp
---@field focus_distance? number along the axis of view, to the plane that is sharp
---@field name? string for messages

---A pinhole, or a thin lens that is sharp at one distance, with square pixels.
---@param keys tessera.PerspectiveKeys
---@return tessera.Camera
function tessera.perspective(keys) end

-- @api orthographic
---@class tessera.OrthographicKeys
---@field eye tessera.Vec3 the middle of the film
---@field look_at? tessera.Vec3 what falls on the middle of the film; differs from eye
---@field up? tessera.Vec3 what is upright on the film; not parallel to the view
---@field width number scene units that the film is wide
---@field name? string for messages

---Parallel rays with square pixels. The film stands in the world at eye: what lies behind it is not seen.
---@param keys tessera.OrthographicKeys
---@return tessera.Camera
function tessera.orthographic(keys) end

-- @api panoramic
---@class tessera.PanoramicKeys
---@field eye tessera.Vec3 where it stands
---@field look_at? tessera.Vec3 what falls on the middle of the film; differs from eye
---@field up? tessera.Vec3 what is upright; not parallel to the view
---@field name? string for messages

---Everything around a point by longitude and latitude: the film is 360 degrees wide and 180 high, so pixels are square on a film twice as wide as high.
---@param keys tessera.PanoramicKeys
---@return tessera.Camera
function tessera.panoramic(keys) end

-- @api raycast
---@class tessera.RaycastKeys

---Nearest hit only: every light shines on it unhindered; mirror and glass show as diffuse of their reflectance.
---@param keys? tessera.RaycastKeys
---@return tessera.Integrator
function tessera.raycast(keys) end

-- @api whitted
---@class tessera.WhittedKeys
---@field max_depth? number longest chain of rays, the camera's included
---@field transparent_shadows? boolean whether glass lets shadow rays pass, weakened by its transmittance at every surface; not physical
---@field min_weight? number rays whose weight in the pixel is this or less are not traced; 0 traces all

---Nearest hit, a shadow ray to every light, reflected and refracted rays.
---@param keys? tessera.WhittedKeys
---@return tessera.Integrator
function tessera.whitted(keys) end

-- @api path
---@class tessera.PathKeys
---@field max_depth? number longest chain of rays, the camera's included: 1 shows only what shines, 2 adds light straight from lights. What longer ones would bring is left out
---@field roulette_depth? number chains at least this long are ended by chance where they carry little, which leaves the mean as it is; max_depth for never
---@field smooth_terminator? boolean whether meshes with vertex normals are shadowed as the smooth surface that these tell of: coarse ones then show no jagged border between light and shadow. It is a bias: where the surface is not as smooth as its normals say, light is not where it should be

---Path tracing: all light, whatever way it took, with noise that falls with the number of samples and no other error, unless smooth_terminator is asked for. raycast and whitted show the nearest of diffuse, mirror and clear glass of each material, the light of tessera.point, spot and directional, and what shines as it is; the rest of this page is for path.
---@param keys? tessera.PathKeys
---@return tessera.Integrator
function tessera.path(keys) end

-- @api probe.every_node
---@class tessera.ProbeEveryNodeKeys
---@field scale? number fraction of the resolution along each edge

---Every node renders the whole frame at low resolution.
---@param keys? tessera.ProbeEveryNodeKeys
---@return tessera.Probe
function tessera.probe.every_node(keys) end

-- @api probe.shared
---@class tessera.ProbeSharedKeys
---@field scale? number fraction of the resolution along each edge

---The nodes share the frame out at low resolution; a small patch, rendered by all, makes their times comparable.
---@param keys? tessera.ProbeSharedKeys
---@return tessera.Probe
function tessera.probe.shared(keys) end

-- @api probe.from
---No probe: costs and powers as an earlier job's manifest tells. Its film must have the same size; nodes that it does not name count as its mean.
---@param manifest string the manifest's file
---@return tessera.Probe
function tessera.probe.from(manifest) end

-- @api split.grid
---@class tessera.SplitGridKeys
---@field size? number edge of square parts in pixels
---@field width? number columns of a part
---@field height? number rows of a part

---Rectangles, smaller at the right and lower border. Give size, or width and height.
---@param keys? tessera.SplitGridKeys
---@return tessera.Split
function tessera.split.grid(keys) end

-- @api split.strips
---@class tessera.SplitStripsKeys
---@field count number horizontal strips of the full width

---@param keys tessera.SplitStripsKeys
---@return tessera.Split
function tessera.split.strips(keys) end

-- @api assign.naive
---Contiguous segments of parts, sized by the nodes' powers alone.
---@type tessera.Assign
tessera.assign.naive = nil

-- @api assign.paper
---The hardest part to the most powerful node, statically, before rendering begins.
---@type tessera.Assign
tessera.assign.paper = nil

-- @api assign.earliest_finish
---Every part, hardest first, to the node that would finish it first; a node that runs out takes from the fullest queue.
---@type tessera.Assign
tessera.assign.earliest_finish = nil

-- @api random
---A generator that gives the same numbers on every machine.
---@param seed? number which numbers
---@return tessera.Random
function tessera.random(seed) end

-- @api random:uniform
---@param lowest? number may come out
---@param highest? number may not
---@return number
function random:uniform(lowest, highest) end

-- @api random:integer
---@param lowest number may come out
---@param highest number may come out too
---@return number
function random:integer(lowest, highest) end

-- @api random:normal
---@param mean? number middle
---@param deviation? number standard deviation
---@return number
function random:normal(mean, deviation) end

-- @api random:in_sphere
---A point inside a sphere about the origin, evenly.
---@param radius? number radius
---@return number[]
function random:in_sphere(radius) end

-- @api random:on_sphere
---A point on a sphere about the origin, evenly.
---@param radius? number radius
---@return number[]
function random:on_sphere(radius) end

-- @api random:in_disc
---A point {x, 0, z} inside a circle about the origin, evenly.
---@param radius? number radius
---@return number[]
function random:in_disc(radius) end

-- @api random:choice
---@generic T
---@param list T[] one of its values comes out
---@return T
function random:choice(list) end

-- @api random:shuffle
---@generic T
---@param list T[] a copy in another order comes out
---@return T[]
function random:shuffle(list) end

-- @api param
---The value of --set name=value, in the type of the default; without a default, a text that must be given. A --set that no script asks for is an error.
---@generic T
---@param name string the parameter
---@param default? T what it is when it is not given
---@return T
function tessera.param(name, default) end

-- @api param_file
---A file. Given with --set it is relative to the working directory and may lie anywhere; the default is relative to the Lua file.
---@param name string the parameter
---@param default? string the file when none is given
---@return string
function tessera.param_file(name, default) end

return tessera
