"""The stack actuator thesis as named data: parameter sets, models, corrections, comparison.

>>> from actuators.printed import TABLE_6_1, named
>>> named(TABLE_6_1, "k")
65000000.0
"""

from __future__ import annotations

from actuators.printed.comparison import error_rows as error_rows
from actuators.printed.comparison import loop_rows as loop_rows
from actuators.printed.comparison import spacing_rows as spacing_rows
from actuators.printed.constants import constant_rows as constant_rows
from actuators.printed.findings import FINDINGS as FINDINGS
from actuators.printed.findings import NOT_REPRODUCIBLE as NOT_REPRODUCIBLE
from actuators.printed.findings import Finding as Finding
from actuators.printed.models import PRINTED_MODELS as PRINTED_MODELS
from actuators.printed.operators import ang_inverse_scaled as ang_inverse_scaled
from actuators.printed.operators import ang_recovered_scaled as ang_recovered_scaled
from actuators.printed.operators import (
    polarisation_operator_printed as polarisation_operator_printed,
)
from actuators.printed.operators import set_6_2 as set_6_2
from actuators.printed.operators import set_6_3 as set_6_3
from actuators.printed.operators import set_6_5 as set_6_5
from actuators.printed.operators import table_6_4 as table_6_4
from actuators.printed.rows import Row as Row
from actuators.printed.tables import ERRORS as ERRORS
from actuators.printed.tables import MEASURED_LOOP as MEASURED_LOOP
from actuators.printed.tables import TABLE_3_1 as TABLE_3_1
from actuators.printed.tables import TABLE_6_1 as TABLE_6_1
from actuators.printed.tables import TABLE_6_2 as TABLE_6_2
from actuators.printed.values import Printed as Printed
from actuators.printed.values import named as named
