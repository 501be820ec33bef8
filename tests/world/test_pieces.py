"""Convex pieces of polygons and lines: in exact arithmetic they cover."""

import numpy as np
import pytest
from exact_cover import exact, left_over, rows, trapezoids
from needs import need

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.common.sets.rational import area, rational_vertices
from parc_jax.problem.world import outlines as pieces
from parc_jax.problem.world.outlines import convex_pieces, thin_pieces

need("shapely")
import shapely  # noqa: E402

COMB = [[0, 0], [5, 0], [5, 3], [4, 3], [4, 1], [3, 1], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3]]
COMB = [*COMB, [0, 3]]
YARD = shapely.Polygon([[0, 0], [6, 0], [6, 5], [0, 5]], [[[1, 1], [2, 4], [3, 1]]])


def star(rng, corners: int):
    """A polygon with deep inlets, somewhere far from the origin."""
    turn = np.sort(rng.uniform(0, 2 * np.pi, corners))
    reach = rng.uniform(0.2, 2.0, corners)[:, None]
    return shapely.Polygon([300.3, -20.7] + reach * np.stack([np.cos(turn), np.sin(turn)], axis=1))


def rings(polygon):
    return [exact(ring.coords[:-1]) for ring in (polygon.exterior, *polygon.interiors)]


def polygons(rng):
    hole = star(rng, 7).buffer(-0.05)
    outer = shapely.box(297, -24, 303, -18)
    holed = outer.difference(hole)
    return [shapely.Polygon(COMB), YARD, holed, *(star(rng, n) for n in (5, 14))]


def test_the_pieces_cover_every_polygon_exactly(rng):
    for polygon in polygons(rng):
        parts = trapezoids(rings(polygon))
        found = convex_pieces(polygon)
        assert left_over(parts, found) == []
        assert left_over(parts, found[1:])  # each is needed: what would be found missing
        # ... and they hold nothing else: their areas add up to the polygon's
        whole = sum(float(area(rational_vertices(piece))) for piece in found)
        assert whole == pytest.approx(polygon.area, rel=1e-9)


def test_a_triangle_that_is_lost_is_noticed(monkeypatch):
    class Forgetful:
        def __getattr__(self, name):
            return getattr(shapely, name)

        def constrained_delaunay_triangles(self, polygon):
            whole = shapely.constrained_delaunay_triangles(polygon)
            return shapely.GeometryCollection(list(whole.geoms)[1:])

    monkeypatch.setattr(pieces, "package", lambda name, call: Forgetful())
    with pytest.raises(SoundnessError, match="not all of it"):
        convex_pieces(COMB)


def test_a_thin_piece_holds_its_segment_exactly_and_no_more_than_its_width(rng):
    segments = rng.uniform(-1e3, 1e3, (40, 2, 2))
    segments[0, 1] = segments[0, 0]  # a point
    for (p, q), piece in zip(segments, thin_pieces(segments), strict=True):
        corners = np.array(rational_vertices(piece), float)
        line = shapely.LineString([p, q])
        for one in exact([p, q]):
            assert all(a[0] * one[0] + a[1] * one[1] <= b for a, b in rows(piece))
        far = max(line.distance(shapely.Point(c)) for c in corners)
        assert pieces.THIN <= far <= pieces.THIN * np.sqrt(2) + 1e-6


SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def test_geojson_and_lines_are_read():
    square = {"type": "Polygon", "crs": None, "coordinates": [[*SQUARE, SQUARE[0]]]}
    wall = {"type": "LineString", "coordinates": [[0, 0], [3, 0], [3, 2]]}
    features = [{"type": "Feature", "properties": {}, "geometry": g} for g in (square, wall)]
    found = convex_pieces({"type": "FeatureCollection", "features": features})
    assert len(found) == 3
    assert found[0].contains(np.array([[0.5, 0.5], [1.0, 1.0]])).all()
    assert found[2].contains(np.array([3.0, 1.5])) and not found[2].contains(np.array([2.9, 1.5]))
    assert len(convex_pieces(features[0])) == len(convex_pieces(square)) == 1


@pytest.mark.parametrize(
    ("outline", "sentence"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "expected a valid Polygon; got one with Self-inters"),
        ([[0, 0], [1, 1]], "expected at least three corners; got 2"),
        ([[0, 0], [np.nan, 1], [1, 0]], "expected finite numbers"),
        ({"type": "Point", "coordinates": [0, 0]}, "expected polygons and lines; got a Point"),
        ({"kind": "Polygon"}, "expected a GeoJSON geometry"),
        ({"type": "Feature", "geometry": None}, "expected places; geometry of feature 0 is null"),
        (
            {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": None}] * 2},
            "expected places; geometry of feature 0 is null",
        ),
        ({"type": "FeatureCollection", "features": []}, "expected at least one polygon or line"),
        ([[0, 0], [1e6, 0], [0, 1]], "coordinates up to 100000 m"),
    ],
)
def test_what_is_no_outline_is_refused_in_one_sentence(outline, sentence):
    with pytest.raises(InputError, match=sentence):
        convex_pieces(outline)


@pytest.mark.parametrize("code", ["OGC:1.3:CRS84", "EPSG::6668", "EPSG::3857", "EPSG::32632"])
def test_a_stated_coordinate_system_is_refused(code):
    """Degrees, metres that are stretched, metres far away: who states one has not left it."""
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:{code}"}}
    square = {"type": "Polygon", "coordinates": [[*SQUARE, SQUARE[0]]]}
    feature = {"type": "Feature", "properties": {}, "geometry": square}
    whole = {"type": "FeatureCollection", "features": [feature]}
    gathered = {"type": "GeometryCollection", "geometries": [square]}
    for one in (
        square | {"crs": crs},
        feature | {"coordRefSys": f"http://www.opengis.net/def/crs/{code}"},
        feature | {"crs": crs},
        feature | {"geometry": square | {"crs": crs}},
        whole | {"crs": crs},
        whole | {"features": [feature | {"crs": crs}]},
        {"type": "GeometryCollection", "geometries": [square | {"crs": crs}]},
        whole | {"features": [feature | {"geometry": {"crs": crs} | gathered}]},
        whole
        | {
            "features": [feature | {"geometry": gathered | {"geometries": [square | {"crs": crs}]}}]
        },
    ):
        with pytest.raises(InputError, match=rf"of no coordinate system; got .*{code}"):
            convex_pieces(one)


def test_geojson_in_degrees_is_refused_though_it_states_nothing():
    """GeoJSON's own coordinates are degrees: a yard of 100 m is an obstacle of a millimetre."""
    yard = np.array([8.5417, 47.3769]) + 1e-3 * np.array([*SQUARE, SQUARE[0]])
    with pytest.raises(InputError, match=r"half of its outlines are below 0\.\d+ m. Are"):
        convex_pieces({"type": "Polygon", "coordinates": [yard.tolist()]})
    road = {"type": "LineString", "coordinates": [[8.54, 47.37], [8.55, 47.37]]}
    houses = [{"type": "Polygon", "coordinates": [(yard + i).tolist()]} for i in range(3)]
    with pytest.raises(InputError, match="half of its outlines are below"):
        convex_pieces({"type": "GeometryCollection", "geometries": [road, *houses]})


def test_coordinate_systems_of_other_libraries_are_refused():
    """Shapely's number, as PostGIS gives it, and what GeoPandas has."""
    marked = shapely.set_srid(shapely.Polygon(SQUARE), 4326)

    class Frame:
        crs = "EPSG:4326"
        __geo_interface__ = shapely.geometry.mapping(shapely.Polygon(SQUARE))

    inner = [{"type": "Feature", "properties": {}, "geometry": one} for one in (marked, Frame())]
    for one in (marked, Frame(), *inner):
        with pytest.raises(InputError, match=r"of no coordinate system; got .*4326\. Project"):
            convex_pieces(one)
