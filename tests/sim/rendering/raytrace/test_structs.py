from drone_rl.sim.rendering.raytrace import structs


def test_each_modality_has_a_bit_of_its_own():
    bits = [structs.RGB, structs.GRAY, structs.DEPTH, structs.DISTANCE]
    bits += [structs.SEGMENTATION, structs.NORMALS]
    assert sorted(map(int, bits)) == [1, 2, 4, 8, 16, 32]
