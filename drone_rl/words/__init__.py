"""What may be said, and when: every sentence that a person reads beside the evidence it needs."""
