"""Mission plans: read, checked, written."""

from mission.plan.plan_file import DEFAULT_PLAN as DEFAULT_PLAN
from mission.plan.plan_file import PlanError as PlanError
from mission.plan.plan_file import read_plan as read_plan
