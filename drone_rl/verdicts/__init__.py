"""What a policy is: good, poor, one-sided or none of these, by a written rule on episodes.

Nothing is imported here, so that what needs no torch (`kinds`) starts without it.
"""
