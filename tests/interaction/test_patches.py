import numpy as np

from historysim.interaction.patches import patches_of

CONTACT = np.array(
    [
        [1, 0, 0, 0, 1],
        [0, 0, 1, 0, 0],
        [0, 0, 1, 0, 0],
        [0, 1, 0, 0, 0],
        [1, 0, 0, 0, 1],
    ],
    dtype=bool,
)


def test_points_that_meet_at_a_side_or_a_corner_are_one_patch_the_largest_first():
    found = patches_of(CONTACT)
    assert (found >= 0).tolist() == CONTACT.tolist()
    assert found[1, 2] == found[2, 2] == found[3, 1] == found[4, 0] == 0
    assert sorted({found[0, 0], found[0, 4], found[4, 4]}) == [1, 2, 3]


def test_a_surface_that_repeats_has_no_border():
    found = patches_of(CONTACT, periodic=True)
    assert set(found[CONTACT].tolist()) == {0}


def test_patches_across_a_corner_of_a_surface_that_repeats_meet():
    corners = np.zeros((5, 5), dtype=bool)
    corners[0, 0] = corners[4, 4] = True
    assert patches_of(corners, periodic=True).max() == 0
    assert patches_of(corners).max() == 1


def test_a_contact_everywhere_and_nowhere():
    assert (patches_of(np.ones((3, 3), dtype=bool)) == 0).all()
    assert (patches_of(np.zeros((3, 3), dtype=bool)) == -1).all()
