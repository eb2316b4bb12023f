"""How kernels are compiled."""

# Measured: inlining everything and fusing products and sums takes a fifth off Warp's own flags.
OPTIONS = {
    "cpu_compiler_flags": "-march=native -ffp-contract=fast -mllvm=-inline-threshold=9000 "
    "-mllvm=-inline-cold-callsite-threshold=3000"
}
