"""The reference scenes in Mitsuba 3, and errors of pictures.

    light.py render s2|s3 VARIANT SAMPLES SEED FILE.exr
    light.py error TRUTH.exr SECONDS FILE.exr SECONDS FILE.exr      (one line: relMSE and seconds of both)
    light.py medians NAME VARIANT SAMPLES < lines
"""
import sys

import numpy as np
import OpenEXR


def read(path):
    channels = OpenEXR.File(path).channels()
    for name in ("RGB", "RGBA"):
        if name in channels:
            return np.asarray(channels[name].pixels, np.float64)[..., :3]
    return np.stack([np.asarray(channels[name].pixels, np.float64) for name in "RGB"], -1)


def relative_error(picture, truth):
    """Mean of squared errors over squared truth + 0.01, the thousandth part of the pixels with the largest left out: rare bright paths would decide alone."""
    errors = np.sort(((picture - truth) ** 2 / (truth**2 + 0.01)).mean(-1).ravel())
    return errors[: int(len(errors) * 0.999)].mean()


def knot():
    """The knot of scripts/reference/s3_mesh_env.lua."""
    t = 2 * np.pi * np.arange(2048)[:, None] / 2048
    a = 2 * np.pi * np.arange(256)[None, :] / 256
    cp, sp, cq, sq = np.cos(2 * t), np.sin(2 * t), np.cos(3 * t), np.sin(3 * t)
    normal = np.stack([cq * cp, sq, cq * sp], -1)
    centre = 0.95 * np.stack([cp, 0 * cp, sp], -1) + 0.42 * normal
    radius = 0.95 + 0.42 * cq
    tangent = np.stack([-1.26 * sq * cp - 2 * radius * sp, 1.26 * cq, -1.26 * sq * sp + 2 * radius * cp], -1)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    binormal = np.cross(tangent, normal)
    bumps = 0.10 * np.sin(40 * t) * np.cos(5 * a) + 0.04 * np.sin(170 * t + 9 * a) + 0.015 * np.cos(400 * t) * np.sin(60 * a)
    depth = 0.20 * (1 + bumps)[..., None]
    vertices = centre + depth * (np.cos(a)[..., None] * normal + np.sin(a)[..., None] * binormal) + (0, 1.2, 0)
    i, j = np.meshgrid(np.arange(2048), np.arange(256), indexing="ij")
    at = lambda i, j: (i % 2048) * 256 + j % 256
    faces = [[at(i, j), at(i + 1, j + 1), at(i + 1, j)], [at(i, j), at(i, j + 1), at(i + 1, j + 1)]]
    faces = np.stack([np.stack(face, -1) for face in faces], -2)
    return vertices.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.uint32)


def render(scene, variant, samples, seed, path):
    import mitsuba as mi

    mi.set_variant(variant)
    import drjit as dr

    dr.set_thread_count(2)
    transform = mi.ScalarTransform4f
    rgb = lambda *color: {"type": "rgb", "value": list(color)}
    matte = lambda *color: {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(*color)}}
    black = {"type": "diffuse", "reflectance": rgb(0, 0, 0)}
    shines = lambda *radiance: {"type": "area", "radiance": rgb(*radiance)}

    def square(middle, turn, scale, **rest):
        """Two by two units in x and y, its front along +z."""
        place = transform().translate(middle)
        for axis, degrees in turn:
            place = place @ transform().rotate(axis, degrees)
        return {"type": "rectangle", "to_world": place @ transform().scale(scale), **rest}

    def view(eye, at, width, height):
        film = {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb", "component_format": "float32", "rfilter": {"type": "box"}}
        place = transform().look_at(eye, at, [0, 1, 0])
        return {"type": "perspective", "fov": 40, "fov_axis": "x", "near_clip": 0.01, "far_clip": 1000, "to_world": place, "film": film, "sampler": {"type": "independent"}}

    x, y = [1, 0, 0], [0, 1, 0]
    if scene == "s2":
        white = matte(0.725, 0.71, 0.68)
        box = transform().translate([-0.35, -0.4, -0.35]) @ transform().rotate(y, 17) @ transform().scale([0.3, 0.6, 0.3])
        mirror = {"type": "twosided", "bsdf": {"type": "conductor", "material": "none", "specular_reflectance": rgb(0.9, 0.9, 0.9)}}
        things = {
            "floor": square([0, -1, 0], [(x, -90)], 1, bsdf=white),
            "ceiling": square([0, 1, 0], [(x, 90)], 1, bsdf=white),
            "back": square([0, 0, -1], [], 1, bsdf=white),
            "left": square([-1, 0, 0], [(y, 90)], 1, bsdf=matte(0.63, 0.065, 0.05)),
            "right": square([1, 0, 0], [(y, -90)], 1, bsdf=matte(0.14, 0.45, 0.091)),
            "lamp": square([0, 0.999, 0], [(x, 90)], 0.25, bsdf=black, emitter=shines(17, 12, 4)),
            "box": {"type": "cube", "to_world": box, "bsdf": white},
            "glass": {"type": "sphere", "center": [0.45, -0.65, 0.25], "radius": 0.35, "bsdf": {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}},
            "mirror": {"type": "sphere", "center": [-0.45, -0.70, 0.50], "radius": 0.30, "bsdf": mirror},
            "sensor": view([0, 0, 3.9], [0, 0, 0], 512, 512),
        }
        depth = 16
    else:
        vertices, faces = knot()
        metal = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.09, "material": "none", "specular_reflectance": rgb(0.90, 0.60, 0.30)}
        properties = mi.Properties()
        properties["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": metal})
        properties["face_normals"] = True
        mesh = mi.Mesh("knot", vertex_count=len(vertices), face_count=len(faces), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = vertices.ravel()
        parameters["faces"] = faces.ravel()
        parameters.update()
        things = {
            "sky": {"type": "constant", "radiance": rgb(0.40, 0.50, 0.60)},
            "ground": square([0, 0, 0], [(x, -90)], 20, bsdf=matte(0.5, 0.5, 0.5)),
            "lamp": {"type": "sphere", "center": [3, 5, 2.5], "radius": 0.25, "bsdf": black, "emitter": shines(150, 135, 110)},
            "knot": mesh,
            "sensor": view([0, 2.2, 6], [0, 1.1, 0], 960, 540),
        }
        depth = 8
    world = mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": depth}, **things})
    picture = np.array(mi.render(world, spp=samples, seed=seed), np.float32)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGB": picture}).write(path)


def main(what, *arguments):
    if what == "render":
        scene, variant, samples, seed, path = arguments
        render(scene, variant, int(samples), int(seed), path)
    elif what == "error":
        truth = read(arguments[0])
        pairs = [(relative_error(read(path), truth), float(seconds)) for seconds, path in zip(arguments[1::2], arguments[2::2])]
        print(*(f"{error:.5f} {seconds:.2f}" for error, seconds in pairs))
    else:
        name, variant, samples = arguments
        rows = np.array([[float(number) for number in line.split()] for line in sys.stdin])
        ours, peer = np.median(rows[:, 0] * rows[:, 1]), np.median(rows[:, 2] * rows[:, 3])
        error, seconds, peer_error, peer_seconds = np.median(rows, 0)
        print(f"{name}, {samples} samples: Tessera relMSE {error:.4f} in {seconds:.2f} s, cost {ours:.3f}; Mitsuba {variant} {peer_error:.4f} in {peer_seconds:.2f} s, cost {peer:.3f}; ratio {peer / ours:.2f}")


main(*sys.argv[1:])
