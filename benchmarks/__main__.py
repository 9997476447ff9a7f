"""Everything that is reported, by one command: ``python -m benchmarks``; about two and a half minutes."""

from benchmarks import ratios, scaling

ratios.main()
scaling.main([])
