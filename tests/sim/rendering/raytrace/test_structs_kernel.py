from drone_rl.sim.rendering.raytrace import structs_kernel


def test_each_modality_has_its_own_bit():
    bits = [structs_kernel.RGB, structs_kernel.GRAY, structs_kernel.DEPTH, structs_kernel.DISTANCE]
    bits += [structs_kernel.SEGMENTATION, structs_kernel.NORMALS]
    assert sorted(map(int, bits)) == [1, 2, 4, 8, 16, 32]
