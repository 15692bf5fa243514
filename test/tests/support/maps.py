"""Checks of the map messages against each other and against their definition in the interface."""
import numpy as np
from sensor_msgs import point_cloud2

# Of a cell that is not known yet.
UNKNOWN = -1


def grid_shape(info):
    return info.height, info.width


def cell_centres(info):
    """(height x width) x and y of the cells' centres, row-major from the origin as OccupancyGrid."""
    x = info.origin.position.x + (np.arange(info.width) + 0.5) * info.resolution
    y = info.origin.position.y + (np.arange(info.height) + 0.5) * info.resolution
    return np.meshgrid(x, y)


def check_field_map(test, message, unit, region, resolution):
    """Sizes, frame, finite means and positive variances; covers the configured region."""
    test.assertEqual(message.header.frame_id, "map")
    test.assertEqual(message.unit, unit)
    test.assertAlmostEqual(message.info.resolution, resolution, delta=1e-6)
    cells = message.info.width * message.info.height
    test.assertEqual((len(message.mean), len(message.variance)), (cells, cells))
    test.assertTrue(np.isfinite(message.mean).all())
    test.assertTrue((np.array(message.variance) > 0).all())
    test.assertEqual(message.info.origin.orientation.w, 1.0)
    x, y = cell_centres(message.info)
    half = 0.5 * resolution + 1e-6
    test.assertLessEqual(x.min() - half, region[0])
    test.assertLessEqual(y.min() - half, region[1])
    test.assertGreaterEqual(x.max() + half, region[2])
    test.assertGreaterEqual(y.max() + half, region[3])


def check_grid(test, grid, field_map, stddev):
    """An OccupancyGrid shows the same cells, scaled linearly to 0..100 over those that are known."""
    test.assertEqual(grid.info, field_map.info)
    data = np.array(grid.data)
    test.assertEqual(len(data), len(field_map.mean))
    known = data != UNKNOWN
    test.assertTrue(((data[known] >= 0) & (data[known] <= 100)).all())
    test.assertGreater(known.sum(), 0, "nothing is known after the drive")
    # What is known is what varies least.
    variance = np.array(field_map.variance)
    if not known.all():
        test.assertLessEqual(variance[known].max(), variance[~known].min() * (1 + 1e-5))
    values = np.sqrt(variance[known]) if stddev else np.array(field_map.mean)[known]
    scaled = 100.0 * (values - values.min()) / (values.max() - values.min())
    np.testing.assert_allclose(data[known], scaled, atol=0.51)


def check_cloud(test, cloud, field_maps):
    """x, y, z and one channel per field and its standard deviation, at the cells' centres."""
    test.assertEqual(cloud.header.frame_id, "map")
    names = [f.name for f in cloud.fields]
    expected = ["x", "y", "z"]
    for name in field_maps:
        expected += [name, name + "_stddev"]
    test.assertEqual(sorted(names), sorted(expected))
    points = np.array(list(point_cloud2.read_points(cloud)))
    test.assertTrue(np.isfinite(points).all())
    for name, field_map in field_maps.items():
        x, y = cell_centres(field_map.info)
        np.testing.assert_allclose(points[:, names.index("x")], x.ravel(), atol=1e-5)
        np.testing.assert_allclose(points[:, names.index("y")], y.ravel(), atol=1e-5)
        np.testing.assert_allclose(points[:, names.index(name)], field_map.mean, rtol=1e-6)
        np.testing.assert_allclose(points[:, names.index(name + "_stddev")], np.sqrt(field_map.variance), rtol=1e-6)
