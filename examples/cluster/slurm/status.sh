#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What has become of the Slurm job $1, in the words that Snakemake knows.
state=$(scontrol show job "$1" 2>/dev/null | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p')
[ -n "$state" ] || state=$(sacct -nXPo State -j "$1" 2>/dev/null | head -n 1)
case $state in
COMPLETED) echo success ;;
PENDING | CONFIGURING | RUNNING | COMPLETING | SUSPENDED | REQUEUED | RESIZING | STAGE_OUT) echo running ;;
*) echo failed ;;
esac
