"""What the README's figures are measured with: ratios within one run, raw rates beside them."""
