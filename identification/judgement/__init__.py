"""Judge fits: what is fine, what is not, what to try; several fits side by side; pictures, report.

`judge` takes what `estimate` returns. The report is in `identification.judgement.report`, the
pictures in `identification.judgement.figures`.
"""

from identification.judgement.compare import Comparison as Comparison
from identification.judgement.compare import compare as compare
from identification.judgement.judge import Judgement as Judgement
from identification.judgement.judge import judge as judge
from identification.judgement.material import Material as Material
from identification.judgement.material import Number as Number
from identification.judgement.material import Record as Record
