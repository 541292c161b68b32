"""Script injection: no string from a file may run on a page.

Each payload is inserted at all places of a page that a string of a file can reach, see
`injected_pages.py`. Chromium opens the pages, and the pointer hovers over and clicks every element.
A payload has run if it changed the document, opened a dialog, or sent a request, or if the page's
content security policy blocked it: escaped text triggers no policy.
"""

import json
import logging
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError, extra

RAN = "document.documentElement.dataset.ran=1"
"""Script of the payloads."""
HOST = "ran.invalid"
"""Host of the payloads; no page may send a request to it."""

_ELEMENTS = (
    f"<script>{RAN}</script>",
    f"<ScRiPt>{RAN}</sCrIpT>",
    f"<script src=//{HOST}/1.js></script>",
    f"<script type=module>{RAN}</script>",
    "<script>alert(1)</script>",
    f"<script>fetch('http://{HOST}/2')</script>",
    f"<script>new Image().src='http://{HOST}/3'</script>",
    f"<img src=x onerror={RAN}>",
    f"<img src=http://{HOST}/4.png>",
    f"<img src=data:, onerror='{RAN}'>",
    f"<svg onload={RAN}>",
    f"<svg><script>{RAN}</script></svg>",
    f"<svg><animate onbegin={RAN} attributeName=x dur=1s>",
    f"<svg><set onbegin={RAN} attributename=x dur=1s>",
    f'<svg><a xlink:href="javascript:{RAN}"><text>x</text></a></svg>',
    f"<svg><use href=//{HOST}/5.svg#x>",
    f"<svg><image href=//{HOST}/6.png>",
    f"<svg><foreignObject><body onload={RAN}>",
    f"<math><mtext><img src=x onerror={RAN}>",
    f"<body onload={RAN}>",
    f"<body onpageshow={RAN}>",
    f"<iframe srcdoc='<script>parent.{RAN}</script>'></iframe>",
    f"<iframe src=javascript:parent.{RAN}></iframe>",
    f"<iframe src=http://{HOST}/7></iframe>",
    f"<object data=http://{HOST}/8></object>",
    f"<object data='data:text/html,<script>parent.{RAN}</script>'></object>",
    f"<embed src=http://{HOST}/9>",
    f"<video onerror={RAN}><source src=x>",
    f"<audio src=x onerror={RAN}>",
    f"<video poster=http://{HOST}/10.png>",
    f"<input autofocus onfocus={RAN}>",
    f"<details open ontoggle={RAN}>",
    f"<select autofocus onfocus={RAN}>",
    f"<textarea autofocus onfocus={RAN}>",
    f"<marquee onstart={RAN}>",
    f"<link rel=stylesheet href=http://{HOST}/11.css>",
    f"<link rel=prefetch href=http://{HOST}/12>",
    f"<link rel=preconnect href=http://{HOST}>",
    f"<meta http-equiv=refresh content='0;url=http://{HOST}/13'>",
    f"<base href=http://{HOST}/>",
    f"<form action=http://{HOST}/14><input type=submit autofocus></form>",
    f"<style>@import 'http://{HOST}/15.css';</style>",
    f"<style>*{{background:url(http://{HOST}/16.png)}}</style>",
    f"<div style='background:url(http://{HOST}/17.png)'>",
    f"<p style=animation-name:x onanimationstart={RAN}>",
    f"<template><script>{RAN}</script></template><script>{RAN}</script>",
    f"<noscript><p title='</noscript><img src=x onerror={RAN}>'>",
    f"<x onclick={RAN} onmousemove={RAN} onpointermove={RAN}>x</x>",
)
"""Elements, for strings that are inserted as markup."""
_BREAKS = (
    f"</script><script>{RAN}</script>",
    f"</script ><img src=x onerror={RAN}>",
    f"</style><script>{RAN}</script>",
    f"</title><script>{RAN}</script>",
    f"</pre></details><script>{RAN}</script>",
    f"</figcaption></table><script>{RAN}</script>",
    f"<!--<script>--><script>{RAN}</script>",
    f"--><script>{RAN}</script>",
    f"]]><script>{RAN}</script>",
    f"<![CDATA[</script><script>{RAN}</script>]]>",
    f'" onload={RAN} autofocus onfocus={RAN} x="',
    f"' onerror={RAN} src=x x='",
    f'"><img src=x onerror={RAN}>',
    f"'><svg onload={RAN}>",
    f'" style="background:url(http://{HOST}/18.png)',
    f"`-{RAN}-`",
    f"${{{RAN}}}",
    f'"-{RAN}-"',
    f"'-{RAN}-'",
    f"\\u003cscript>{RAN}</script>",
    f'\\";{RAN};//',
    f'"}});{RAN};({{"',
)
"""Payloads that end an attribute, a script, a style sheet or a comment."""
_OTHERS = (
    f"javascript:{RAN}",
    f"JaVaScRiPt:{RAN}//",
    f"data:text/html,<script>{RAN}</script>",
    f"//{HOST}/19",
    f"http://{HOST}/20",
    f"red;background:url(http://{HOST}/21.png)",
    f"expression({RAN})",
    f"{{{{ cycler.__init__.__globals__ }}}}<img src=x onerror={RAN}>",
    f"{{% raw %}}<script>{RAN}</script>",
    f"`<script>{RAN}</script>`",
    f"&lt;script&gt;{RAN}&lt;/script&gt;",
    f"&#60;img src=x onerror={RAN}&#62;",
    f"\uff1cscript\uff1e{RAN}\uff1c/script\uff1e",
    f"__proto__<img src=x onerror={RAN}>",
)
"""Payloads for links, style sheets, templates, and for text that is decoded twice."""
PAYLOADS = (*_ELEMENTS, *_BREAKS, *_OTHERS)
"""All payloads; each is one line of printable characters, as readers of files require."""
MARKUP = _ELEMENTS
"""Payloads that the page's policy must block if they are inserted as markup."""


_INTERACT = """
document.querySelectorAll("details").forEach(d => { d.open = true; });
const click = (element, kinds) => {
  const box = element.getBoundingClientRect();
  for (const kind of kinds) for (const at of [.1, .5, .9]) {
    const place = { clientX: box.left + at * box.width, clientY: box.top + at * box.height };
    element.dispatchEvent(new PointerEvent(kind, { bubbles: true, ...place }));
  }
};
document.querySelectorAll("canvas, svg, svg *, button, x").forEach(
  element => click(element, ["mousemove", "pointermove", "click"]));
document.querySelectorAll("canvas").forEach(canvas => {
  const box = canvas.getBoundingClientRect();
  for (let x = 4; x < box.width; x += 12) {
    const place = { clientX: box.left + x, clientY: box.top + box.height / 2, bubbles: true };
    canvas.dispatchEvent(new MouseEvent("mousemove", place));
    canvas.dispatchEvent(new MouseEvent("click", place));
  }
});
const bad = "[onerror], [onload], [onclick], iframe:not([srcdoc]), object, embed, base, form, " +
  "meta[http-equiv=refresh], a[href^=javascript i], a[href^='//'], a[href^=http]";
return document.querySelectorAll(bad).length;
"""
"""Hover over and click every element; return the number of elements that can run a script."""
_HAS_RUN = "setTimeout(() => arguments[0](document.documentElement.dataset.ran || ''), 60)"
"""Return after 60 ms whether a script has run."""
_log = logging.getLogger(__name__)
_NAVIGATES = ("http-equiv=refresh", "rel=preconnect", "rel=prefetch")
"""Markup that a content security policy can't block; only escaping prevents it."""


def bench_injections(folder: Path, explanation: Path | None = None) -> dict[str, int]:
    """Open every page with every payload.

    Args:
        folder: Folder of the files; created if missing.
        explanation: Folder of an explanation; by default a shipped policy is explained.

    Returns:
        "injections_run" and "injections_total", numbers of pairs of a payload and a page.

    Raises:
        InputError: Chromium or its driver is not installed.
    """
    outcomes = open_all(folder, explanation or explained(folder), PAYLOADS)
    for outcome in outcomes:
        if outcome["ran"]:
            _log.warning("%(page)s, %(payload)s: %(ran)s", outcome)
    return {
        "injections_run": sum(bool(outcome["ran"]) for outcome in outcomes),
        "injections_total": len(outcomes),
    }


def explained(folder: Path) -> Path:
    """Explain a shipped policy on few frames; return the explanation's folder."""
    from drone_rl.explanations.explain import explain
    from drone_rl.explanations.settings import ExplainSettings

    few = ExplainSettings(frames=180, episodes=6, perplexity=5)
    result = explain("good", few, folder=folder / "explained", num_envs=8, outputs=folder)
    return next(result.folder.glob("*/explanation.json")).parent


def open_all(
    folder: Path, explanation: Path, payloads: Iterable[str], *, names: bool = True
) -> list[dict[str, Any]]:
    """Open all pages with some payloads.

    Args:
        folder: Folder of the files; created if missing.
        explanation: Folder of an explanation.
        payloads: Payloads to insert.
        names: See `Pages`.

    Returns:
        For each page and payload "page", "payload" and "ran" (what ran; empty if nothing did).
    """
    from benchmarks.injected_pages import Pages, with_markup

    pages, outcomes = Pages(explanation, summary(folder), folder, names=names), []
    with chromium(folder / "profile") as browser:
        for payload in payloads:
            injected = pages.inject(payload)
            if payload in MARKUP and not any(name in payload for name in _NAVIGATES):
                injected["markup_under_policy"] = with_markup(
                    pages.inject("text")["report"], payload
                )
            for name, html in injected.items():
                path = folder / "page.html"
                path.write_text(html, encoding="utf-8")
                ran = what_ran(browser, path, is_markup=name == "markup_under_policy")
                outcomes.append({"page": name, "payload": payload, "ran": ran})
    return outcomes


def summary(folder: Path) -> dict[str, Any]:
    """Return the summary of a sweep with runs of each state."""
    from drone_rl.sweeps.manifest import Run, open_sweep
    from drone_rl.sweeps.rows import read_rows
    from drone_rl.sweeps.summary import summarise_sweep

    sweep = folder / "sweep"
    shutil.rmtree(sweep, ignore_errors=True)
    runs = [Run(i, (f"optimizer.lr={i}", f"seed={i}"), sweep / str(i)) for i in range(3)]
    begun = open_sweep(sweep, ["drone-rl", "train", "-m", "seed=0,1"], {"seed": 0}, runs)
    for run in runs[:2]:
        run.folder.mkdir()
    runs[0].failure.write_text(json.dumps({"error": "it failed"}))
    figures = {"frames": 9, "episodes": 3, "seconds": 2.0, "running_reward": 2.9}
    (runs[1].folder / "result.json").write_text(
        json.dumps({"reason": "solved", **figures, "largest_reward": 3})
    )
    (runs[1].folder / "metrics.csv").write_text("frames,train/running_reward\n9,2.9\n")
    return json.loads(json.dumps(summarise_sweep(begun, read_rows(begun))))


@contextmanager
def chromium(profile: Path) -> Iterator[Any]:
    """Start a headless Chromium.

    Args:
        profile: Folder of the browser's profile.

    Raises:
        InputError: Chromium or its driver is not installed.
    """
    webdriver = extra("selenium.webdriver", "dev", "bench injections")
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    if not (program and driver):
        raise InputError(
            "bench injections needs chromium and chromedriver; install them, on Debian with "
            "apt-get install chromium chromium-driver"
        )
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in (
        "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        "--window-size=1200,900", f"--user-data-dir={profile.absolute()}",
    ):  # fmt: skip
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    options.set_capability("unhandledPromptBehavior", "ignore")
    browser = webdriver.Chrome(options, webdriver.ChromeService(driver))
    try:
        yield browser
    finally:
        browser.quit()


def what_ran(browser: Any, path: Path, *, is_markup: bool = False) -> str:
    """Open a page and interact with every element.

    Args:
        browser: Result of `chromium`.
        path: Path of the page.
        is_markup: Whether the payload is inserted as markup on purpose. If so, the page's policy
            may block it; else a blocked payload counts as run.

    Returns:
        What ran; empty if nothing did.
    """
    from selenium.common.exceptions import (
        JavascriptException,
        NoAlertPresentException,
        UnexpectedAlertPresentException,
    )

    for kind in ("browser", "performance"):
        browser.get_log(kind)
    found: list[str] = []
    try:
        browser.get(path.absolute().as_uri())
        elements = browser.execute_script(_INTERACT)
        ran = browser.execute_async_script(_HAS_RUN)  # image errors are asynchronous
        found += ["a script"] if ran else []
        found += [f"{elements} elements"] if elements and not is_markup else []
    except UnexpectedAlertPresentException:
        found.append("a dialog")
    except JavascriptException as error:
        found.append(f"an error: {error.msg}")
    try:
        browser.switch_to.alert.dismiss()
        found.append("a dialog")
    except NoAlertPresentException:
        pass
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    found += [f"a request: {url}" for url in _requests(messages, path)]
    if not is_markup:
        severe = [e["message"] for e in browser.get_log("browser") if e["level"] == "SEVERE"]
        found += [f"an error: {message}" for message in severe]
    return "; ".join(found)[:1000]


def _requests(messages: Sequence[dict[str, Any]], path: Path) -> list[str]:
    """Return the URLs outside the page that were requested and not blocked before sending."""
    failed = [m["params"] for m in messages if m["method"] == "Network.loadingFailed"]
    stopped = {of["requestId"] for of in failed if of.get("blockedReason")}
    sent = [m["params"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    urls = [of["request"]["url"] for of in sent if of["requestId"] not in stopped]
    page = path.absolute().as_uri()
    ours = [url for url in urls if url.startswith(("http", "file:", "ftp:")) or HOST in url]
    return [url for url in ours if url.partition("#")[0] != page]
