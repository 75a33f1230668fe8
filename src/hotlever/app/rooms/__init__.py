"""The rooms of the app, one module each; each is a function that fills a page."""
