#!/usr/bin/env bash
# Builds the fuzz targets and runs each for some time, on the stored cases and on what libFuzzer makes of them.
# Usage: tests/fuzz/run.sh SECONDS [TARGET...]; 30 seconds look for what a change broke, a release gets an hour.
# D2S1R_FUZZ_JOBS (by default the number of processors) targets run at a time. New cases are kept in D2S1R_FUZZ_CASES
# (by default build/fuzz/cases), from where a later run goes on; a case that breaks a promise is named at the end. The
# processor seconds that are printed count the processes of their own, too; those of several runs add up.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=$1
shift
targets=("$@")
if [[ ${#targets[@]} == 0 ]]; then
	for corpus in tests/fuzz/corpus/*/; do targets+=("$(basename "$corpus")"); done
fi
jobs=${D2S1R_FUZZ_JOBS:-$(nproc)}
[[ -f build/fuzz/CMakeCache.txt ]] || cmake --preset fuzz
cmake --build --preset fuzz -j "$jobs" --target "${targets[@]/#/fuzz_}"

# Runs one target, and prints what it tells at its end.
fuzz() {
	local seconds=$1 target=$2 status=0
	local cases=${D2S1R_FUZZ_CASES:-build/fuzz/cases}/$target log=build/fuzz/fuzz_$target.log found=build/fuzz/found_$target-
	mkdir -p "$cases"
	rm -f "$found"*
	# The limits are the promised ones (doc/promises.md): 1.024 GB at once, and twice that in all, with what the sanitizers
	# take; 10 s for a case, which take 25 with the sanitizers. A process of its own has 120 s.
	# The thread that watches the memory may hold a lock of the sanitizer while a target forks, and the process of its own
	# would wait for it forever.
	local memory=2560 timeout=25
	[[ $target != rawlog && $target != map_file ]] || memory=0 timeout=130
	export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=0
	local TIMEFORMAT="processor_seconds: %U %S"
	{ time "build/fuzz/tests/fuzz/fuzz_$target" \
		-max_total_time="$seconds" -max_len=16384 -timeout="$timeout" -malloc_limit_mb=1100 -rss_limit_mb="$memory" -print_final_stats=1 \
		-artifact_prefix="$found" "$cases" "tests/fuzz/corpus/$target" 2>&1; } >"$log" 2>&1 || status=$?
	if [[ $status != 0 ]]; then
		echo "$target: a finding, see $log and $found*"
		grep -E "broken promise|ERROR|runtime error|SUMMARY|Test unit written" "$log" || true
		exit 255 # xargs stops
	fi
	rm -f "$found"* # of processes of their own, which may crash
	local coverage runs spent
	spent=$(awk '/^processor_seconds:/ { printf "%.0f", $2 + $3 }' "$log")
	coverage=$(grep -oE "cov: [0-9]+" "$log" | tail -n 1)
	runs=$(grep -oE "number_of_executed_units: +[0-9]+" "$log" | grep -oE "[0-9]+$")
	echo "$target: $runs cases in $spent processor seconds, ${coverage#cov: } edges covered"
}
export -f fuzz
printf '%s\n' "${targets[@]}" | xargs -P "$jobs" -I{} bash -c "set -euo pipefail; fuzz $seconds {}"
