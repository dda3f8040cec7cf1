"""The stack actuator thesis as named data: parameter sets, models, corrections, comparison.

>>> from actuators.thesis import TABLE_6_1, named
>>> named(TABLE_6_1, "k")
65000000.0
"""

from actuators.thesis.comparison import error_rows as error_rows
from actuators.thesis.comparison import loop_rows as loop_rows
from actuators.thesis.comparison import spacing_rows as spacing_rows
from actuators.thesis.constants import constant_rows as constant_rows
from actuators.thesis.findings import FINDINGS as FINDINGS
from actuators.thesis.findings import NOT_REPRODUCIBLE as NOT_REPRODUCIBLE
from actuators.thesis.findings import ThesisFinding as ThesisFinding
from actuators.thesis.models import PRINTED_MODELS as PRINTED_MODELS
from actuators.thesis.operators import ang_inverse_scaled as ang_inverse_scaled
from actuators.thesis.operators import ang_recovered_scaled as ang_recovered_scaled
from actuators.thesis.operators import (
    polarisation_operator_printed as polarisation_operator_printed,
)
from actuators.thesis.operators import set_6_2 as set_6_2
from actuators.thesis.operators import set_6_3 as set_6_3
from actuators.thesis.operators import set_6_5 as set_6_5
from actuators.thesis.operators import table_6_4 as table_6_4
from actuators.thesis.rows import ComparisonRow as ComparisonRow
from actuators.thesis.tables import ERRORS as ERRORS
from actuators.thesis.tables import MEASURED_LOOP as MEASURED_LOOP
from actuators.thesis.tables import TABLE_3_1 as TABLE_3_1
from actuators.thesis.tables import TABLE_6_1 as TABLE_6_1
from actuators.thesis.tables import TABLE_6_2 as TABLE_6_2
from actuators.thesis.values import Printed as Printed
from actuators.thesis.values import named as named
