#!/bin/sh
# Tells Snakemake how a job of Slurm fares: running, success or failed. Slurm knows an ended job for five minutes
# (MinJobAge); Snakemake asks more often. A controller that does not answer may be back soon.
# Usage: status.sh JOB
answer=$(LC_ALL=C scontrol --oneliner show job "$1" 2>&1)
case "$answer" in
  *JobState=COMPLETED*) echo success ;;
  *JobState=PENDING* | *JobState=RUNNING* | *JobState=COMPLETING* | *JobState=CONFIGURING* | *JobState=SUSPENDED* | \
    *JobState=REQUEUE* | *JobState=RESIZING* | *JobState=STAGE_OUT* | *JobState=SIGNALING* | *JobState=STOPPED*)
    echo running ;;
  *JobState=* | *'Invalid job id'*) echo failed ;;
  *) echo running ;;
esac
