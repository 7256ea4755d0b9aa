"""From where a scene is seen."""

import numpy as np
import pytest

from mjnav.world.render import FIELD_OF_VIEW, overview


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.3])
@pytest.mark.parametrize("azimuth", [0.0, 90.0, 200.0])
@pytest.mark.parametrize("elevation", [-20.0, -50.0, -89.0])
def test_all_points_and_heads_above_them_are_in_the_picture_and_fill_it(aspect, azimuth, elevation):
    floor = np.array([[-2.0, -3.0], [12.0, -3.0], [12.0, 3.0], [-2.0, 3.0], [5.0, 0.0]])
    camera = overview(floor, aspect, azimuth=azimuth, elevation=elevation)
    a, e = np.radians([azimuth, elevation])
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    eye = camera.lookat - camera.distance * ahead
    seen = np.vstack([np.column_stack([floor, np.full(5, z)]) for z in (0.0, 1.7)]) - eye
    depth = seen @ ahead
    x = seen @ right / depth / (np.tan(0.5 * FIELD_OF_VIEW) * aspect)
    y = seen @ np.cross(right, ahead) / depth / np.tan(0.5 * FIELD_OF_VIEW)
    assert depth.min() > 0.0
    assert np.abs([x, y]).max() <= 1.0  # of half the picture
    assert np.abs([x, y]).max() > 0.8
