"""A local page to fly from: a person or a policy flies one drone and sees what the policy sees.

`Flight` owns the simulation, `FlyPage` serves it to browsers; index.html, fly.js and fly.css are
the page.
"""
