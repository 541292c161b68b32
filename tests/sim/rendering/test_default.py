from drone_rl.sim.rendering import Raytracer, make_renderer
from drone_rl.sim.worlds import Worlds


def test_a_cpu_draws_by_our_own():
    worlds = Worlds(1)
    renderer = make_renderer(worlds.scene, num_worlds=1)
    assert isinstance(renderer, Raytracer)
    assert isinstance(worlds.renderer, Raytracer)
    renderer.close()
    worlds.close()
