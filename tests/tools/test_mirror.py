from tools.mirror import PURE_DATA, ROOT, count_lines, modules_without_test


def test_modules_and_tests_match_by_name_and_folder(tmp_path):
    for name in ("a", "b", "deep/a", "deep/c", "__init__", "config/networks"):
        path = tmp_path / "drone_rl" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1\n2\n")
    for name in ("test_a", "deep/test_c", "test_deep"):
        path = tmp_path / "tests" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1\n2\n3\n")
    assert modules_without_test(tmp_path) == ["b", "deep/a"]
    assert count_lines(tmp_path / "drone_rl") == 12
    assert count_lines(tmp_path / "tests") == 9


def test_exempt_modules_exist_and_have_a_reason():
    assert all(
        (ROOT / "drone_rl" / f"{name}.py").exists() and reason for name, reason in PURE_DATA.items()
    )
