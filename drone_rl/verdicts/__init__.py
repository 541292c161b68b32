"""What kind of policy this is: the rule, luck and oracle beside it, and how it fails."""
