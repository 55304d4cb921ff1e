export { init, use, registerTheme, graphic, getInstanceByDom, connect, version, format, number } from 'echarts/core';
import { use } from 'echarts/core';
import { LineChart, ScatterChart, BarChart, HeatmapChart, CustomChart } from 'echarts/charts';
import { GridComponent, TooltipComponent, LegendComponent, DataZoomInsideComponent, ToolboxComponent, VisualMapContinuousComponent, MarkLineComponent, TitleComponent, AriaComponent, AxisPointerComponent, GraphicComponent } from 'echarts/components';
import { CanvasRenderer, SVGRenderer } from 'echarts/renderers';
use([LineChart, ScatterChart, BarChart, HeatmapChart, CustomChart, GridComponent, TooltipComponent, LegendComponent, DataZoomInsideComponent, ToolboxComponent, VisualMapContinuousComponent, MarkLineComponent, TitleComponent, AriaComponent, AxisPointerComponent, GraphicComponent, CanvasRenderer, SVGRenderer]);
