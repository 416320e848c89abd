# SPDX-License-Identifier: MIT
"""Colours and transparency of objects, and the materials of the server that are made of them.

A look is a tuple (red, green, blue, transparency) of numbers from 0 to 1, as FreeCAD shows them on
a screen. Looks of an object are a tuple with one for all of its faces, or one for each.
"""
GREY = (0.8, 0.8, 0.8, 0.0)  # FreeCAD's own default
ROUGHNESS = 0.45
GLASS_ROUGHNESS = 0.0


def of_object(thing, face_count):
    """From its view provider; without a window from the materials that the document has."""
    found = _of_view(getattr(thing, "ViewObject", None)) or _of_materials(thing) or (GREY,)
    return found if len(found) in (1, face_count) else found[:1]


def of_link(link):
    """The one look with which a link covers what it shows, or None."""
    view = getattr(link, "ViewObject", None)
    if view is None or not getattr(view, "OverrideMaterial", False):
        return None
    return (_of_material(view.ShapeMaterial),)


def _of_view(view):
    if view is None:
        return None
    if hasattr(view, "ShapeAppearance"):  # from FreeCAD 1.0 on
        return _shortest(tuple(_of_material(one) for one in view.ShapeAppearance))
    if not hasattr(view, "ShapeColor"):
        return None
    transparency = getattr(view, "Transparency", 0) / 100
    colors = getattr(view, "DiffuseColor", None) or [view.ShapeColor]
    return _shortest(tuple((*color[:3], max(transparency, color[3])) for color in colors))


def _shortest(looks):
    return looks[:1] if len(set(looks)) == 1 else looks


def _of_material(material):
    return (*material.DiffuseColor[:3], material.Transparency)


def _of_materials(thing):
    """Of a material object, as the workbench BIM has them, or of a material card (FreeCAD 1.0)."""
    card = getattr(getattr(thing, "Material", None), "Material", None)
    found = _of_card(card, 100) if isinstance(card, dict) else None
    if found is None:
        found = _of_card(getattr(getattr(thing, "ShapeMaterial", None), "Properties", {}), 1)
    return found


def _of_card(card, whole):
    """whole: the number that stands for all transparent."""
    try:
        color = [float(value) for value in card["DiffuseColor"].strip("()").split(",")[:3]]
        transparency = float(card.get("Transparency") or 0) / whole
    except (KeyError, ValueError, AttributeError):
        return None
    return ((*color, min(max(transparency, 0.0), 1.0)),) if len(color) == 3 else None


def kinds(found):
    """The different ones, each of which becomes a material, in the order of their first faces."""
    return list(dict.fromkeys(found))


def recolored(old, new):
    """What each of the kinds of old looks has become, None where faces of one kind differ now."""
    if len(new) == 1:
        return list(new) * len(kinds(old))
    became = {}
    if len(new) != len(old) or any(became.setdefault(was, now) != now
                                   for was, now in zip(old, new)):
        return None
    return [became[kind] for kind in kinds(old)]


def _linear(value):
    """sRGB to linear light (IEC 61966-2-1)."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def override(look, glass=True):
    """The members of overrides.materials that make a material look so.

    glass: a transparent object is glass, which reflects and tints the light that passes it; else
    a surface that covers a share of what is behind it."""
    red, green, blue = (_linear(min(max(value, 0.0), 1.0)) for value in look[:3])
    clear = look[3]
    through = glass and clear > 0
    return {"base_color": [red, green, blue, 1.0 if glass else 1.0 - clear],
            "alpha_mode": "blend" if clear > 0 and not glass else "opaque",
            "transmission": clear if through else 0.0,
            "roughness": GLASS_ROUGHNESS if through else ROUGHNESS}


def material(name, look, glass=True):
    """The same as a material of a glTF file."""
    members = override(look, glass)
    made = {"name": name, "doubleSided": True, "alphaMode": members["alpha_mode"].upper(),
            "pbrMetallicRoughness": {"baseColorFactor": members["base_color"], "metallicFactor": 0,
                                     "roughnessFactor": members["roughness"]}}
    if members["transmission"] > 0:
        made["extensions"] = {"KHR_materials_transmission":
                              {"transmissionFactor": members["transmission"]}}
    return made
