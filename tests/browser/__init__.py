"""A package, so that fixtures of package scope end with these tests: Playwright keeps an event loop running until then."""
