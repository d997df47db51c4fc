"""Many runs: which cases a sweep is made of, the workers that compute them, and what their results say."""
