"""Tells which methods of a job do nothing in a scene, and what of the scene they leave out."""

LOBE = "a material is glossy with a roughness above 0, the number after its mu_r (GLO-2)"


def doubts(scene, jobs, free=()) -> list[tuple[str, str]]:
    """Returns what is seldom meant, each with its remedy.

    jobs: `job.Parameters` of pictures of the scene: a method of any of them may do nothing; what all of them leave out
    is left out. free: names of methods that are still to be chosen.
    """
    rough = any(thing.material.k_s > 0 and thing.material.roughness > 0 for thing in scene.objects)
    soft = any(light.radius > 0 for light in scene.lights)
    found = []
    if "glossy_rays" not in free:
        most = max((job.glossy_rays for job in jobs if job.depth > 0), default=None)
        if most and not rough:
            found.append(("glossy_rays does nothing here: every mirror is perfect", LOBE))
        if most == 0 and rough:
            found.append(("its glossy materials are rendered as perfect mirrors", "ask for glossy_rays, 1 or more"))
    if "feelers" not in free and scene.objects:
        most = max((job.feelers for job in jobs if job.shadows), default=None)
        if most and not soft:
            found.append(("feelers does nothing here: every light is a point", "a light is soft with a radius above 0"))
        if most == 0 and soft:
            found.append(("its lights with a radius are rendered as points", "ask for feelers, 1 or more"))
    return found
