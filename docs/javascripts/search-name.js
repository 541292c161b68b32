// Name the search dialog for screen readers; the theme does not.
document.querySelector(".md-search")?.setAttribute("aria-label", "Search");
