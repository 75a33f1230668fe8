"""The pages of the app: what each asks, what it has done, and what it shows."""
