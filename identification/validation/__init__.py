"""Judge fits: what is fine, what is not, what to try; several fits side by side; pictures, report.

`judge` takes what `estimate` returns. The report is in `identification.validation.report`, the
pictures in `identification.validation.figures`.
"""

from identification.validation.compare import Comparison as Comparison
from identification.validation.compare import compare as compare
from identification.validation.judge import Judgement as Judgement
from identification.validation.judge import judge as judge
from identification.validation.validation_data import Number as Number
from identification.validation.validation_data import ValidationData as ValidationData
from identification.validation.validation_data import ValidationRecord as ValidationRecord
