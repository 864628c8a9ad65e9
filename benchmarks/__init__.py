"""Run time against error, throughput, memory and start-up: `python -m benchmarks`."""
