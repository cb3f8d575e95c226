from sim.world.batch import grown_world
from sim.world.driving_worlds import CAR_PARK
from sim.world.spots import spots_of


def test_the_spots_of_a_car_park_are_numbered_and_each_row_has_a_free_one():
    for seed in range(5):
        spots = spots_of(grown_world(CAR_PARK.model_copy(update={"seed": seed}), seed))
        assert [spot.number for spot in spots] == list(range(1, 11))
        assert any(spot.is_free for spot in spots[:5])
        assert any(spot.is_free for spot in spots[5:])
        assert not all(spot.is_free for spot in spots)


def test_a_world_that_is_no_car_park_has_no_spots():
    assert spots_of(grown_world(CAR_PARK.model_copy(update={"spot_count": 0}), 1)) == []
